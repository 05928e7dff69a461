"""Rows come back from their file as they were."""

from dataclasses import replace

import numpy as np
import pytest
from toy_results import measured, results_of, truths_of

from pipelines.errors import UserError
from pipelines.metrics.results import read_results, write_results


class TestRows:
    def test_come_back_as_they_were(self, tmp_path):
        truths = truths_of()
        written = [results_of(truths, method="a"), results_of(truths, seed=2, k=1, method="b")]
        write_results(tmp_path / "r.npz", written, {"split": "test"})
        read, context = read_results(tmp_path / "r.npz")
        assert context == {"split": "test"}
        assert [item.method for item in read] == ["a", "b"]
        for there, here in zip(written, read, strict=True):
            assert measured(there) == measured(here)
            k = there.proposals.shape[2]
            np.testing.assert_array_equal(here.proposals[:, :, :k], there.proposals)
            assert np.isnan(here.proposals[:, :, k:]).all()
            for name, values in vars(there.truths).items():
                np.testing.assert_array_equal(getattr(here.truths, name), values)

    def test_are_one_a_frame_joint_and_method(self, tmp_path):
        truths = truths_of(7)
        write_results(tmp_path / "r.npz", [results_of(truths, method=m) for m in "ab"], {})
        with np.load(tmp_path / "r.npz") as file:
            keys = np.stack([file["method"], file["frame"], file["joint"]], axis=1)
            assert all(len(file[name]) == 2 * 7 * 3 for name in file if name != "header")
        assert len(np.unique(keys, axis=0)) == len(keys)

    def test_are_the_same_bytes_again(self, tmp_path):
        for name in "ab":
            write_results(tmp_path / name, [results_of(truths_of())], {"seed": 1})
        assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]

    def test_of_some_joints_are_those_joints(self):
        results = results_of(truths_of())
        part = results.of_joints(("torso", "head"))
        assert part.truths.joints == ("torso", "head")
        np.testing.assert_array_equal(part.proposals, results.proposals[:, [2, 0]])
        assert measured(part.of_joints(("head",))) == measured(results.of_joints(("head",)))
        with pytest.raises(UserError, match="joints tail are unknown"):
            results.of_joints(("tail",))

    @pytest.mark.parametrize("damage", ["missing", "foreign", "torn", "flipped", "version"])
    def test_a_file_that_holds_no_results_is_told(self, damage, tmp_path):
        path = tmp_path / "r.npz"
        write_results(path, [results_of(truths_of())], {})
        data = bytearray(path.read_bytes())
        if damage == "missing":
            path.unlink()
        elif damage == "foreign":
            path.write_bytes(b"not rows")
        elif damage == "torn":
            path.write_bytes(data[:-100])
        elif damage == "flipped":
            data[len(data) // 2] ^= 255
            path.write_bytes(data)
        else:
            columns = dict(np.load(path))
            columns["header"] = np.array('{"schema": "undergrowth results", "schema_version": 99}')
            np.savez(path, **columns)
        with pytest.raises(UserError, match=r"r\.npz"):
            read_results(path)

    def test_damaged_bytes_give_the_same_rows_or_one_error(self, tmp_path):
        path, rng = tmp_path / "r.npz", np.random.default_rng(0)
        written = results_of(truths_of(5))
        write_results(path, [written], {})
        whole = path.read_bytes()
        n_refused = 0
        for _ in range(400):
            torn = bytearray(whole)
            torn[rng.integers(len(torn))] ^= 1 << int(rng.integers(8))
            path.write_bytes(torn)
            try:
                (read,), _ = read_results(path)
            except UserError:
                n_refused += 1
            else:
                np.testing.assert_array_equal(read.proposals, written.proposals)
                np.testing.assert_array_equal(read.truths.xyz, written.truths.xyz)
        assert n_refused > 200

    def test_two_methods_of_one_name_are_refused(self, tmp_path):
        results = results_of(truths_of())
        with pytest.raises(ValueError, match="different names"):
            write_results(tmp_path / "r.npz", [results, results], {})

    def test_a_wrong_shape_is_told(self):
        results = results_of(truths_of())
        with pytest.raises(ValueError, match="probability has shape"):
            replace(results, probability=results.probability[:, :2])
