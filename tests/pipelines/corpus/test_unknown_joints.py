"""A joint whose place is unknown is NaN from the disk to the forest, and nothing else is."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
import zarr
from toy_source import ToySource

from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.laws import broken_laws
from pipelines.corpus.sequence import CorpusFrames
from pipelines.export.write import export
from pipelines.metrics.truths import read_truths
from synth.vocabulary import JOINT_NAMES, JointState

HIPS = [JOINT_NAMES.index("r_hip"), JOINT_NAMES.index("l_hip")]
N_FRAMES = 20


class Partial(ToySource):
    """Frames without hips; what stands in their place is up to the test."""

    def __init__(self, place):
        super().__init__(3, N_FRAMES)
        self.place = place

    def frame(self, index):
        frame = super().frame(index)
        joints, state, share = frame.joints.copy(), frame.joint_state.copy(), frame.joint_visible_fraction.copy()
        joints[HIPS], state[HIPS], share[HIPS] = self.place, JointState.UNKNOWN, 0.0
        return replace(frame, joints=joints, joint_state=state, joint_visible_fraction=share)


def corpus_of(order, folder, place):
    write_corpus(folder, replace(order(N_FRAMES), make_source=lambda: Partial(place)))
    return Corpus.open(folder)


@pytest.fixture(params=[np.nan, 0.0], ids=["NaN", "zeros"])
def corpus(request, tmp_path, order):
    """As recordings are stored, and as they may have been."""
    return corpus_of(order, tmp_path / "corpus", request.param)


def is_unknown_alone(joints):
    return np.isnan(joints[..., HIPS, :]).all() and np.isfinite(np.delete(joints, HIPS, axis=-2)).all()


def test_unknown_joints_and_no_others_are_nan_wherever_they_are_read(corpus):
    assert is_unknown_alone(corpus.arrays("joints"))
    assert is_unknown_alone(corpus.arrays("joints", [7, 3]))
    assert is_unknown_alone(corpus[5].joints)
    assert is_unknown_alone(corpus[5].joints_2d)
    assert is_unknown_alone(CorpusFrames(corpus, corpus.indices)[5].joints)
    assert is_unknown_alone(read_truths(corpus, corpus.indices).xyz)
    assert not any("joint" in fault for frame in corpus.frames() for fault in broken_laws(frame, corpus.header))


def test_the_disk_holds_nan(order, tmp_path):
    corpus = corpus_of(order, tmp_path / "corpus", np.nan)
    assert is_unknown_alone(zarr.open_group(corpus.path / "arrays.zarr", mode="r")["joints"][:])


def test_an_unknown_joint_with_a_place_breaks_a_law(order, tmp_path):
    corpus = corpus_of(order, tmp_path / "corpus", (0.0, 0.0, 2.0))
    assert "an unknown joint has a place or a visible fraction" in list(broken_laws(corpus[0], corpus.header))


def test_exports_say_that_nothing_is_known(corpus, tmp_path):
    export(corpus, "coco", tmp_path / "coco", ("train",))
    text = (tmp_path / "coco" / "annotations" / "train.json").read_text()
    assert "NaN" not in text
    for annotation in json.loads(text)["annotations"]:
        for joint in HIPS:
            assert annotation["keypoints"][3 * joint : 3 * joint + 3] == [0, 0, 0]
            assert annotation["joints_camera_m"][joint] is None
        assert sum(place is None for place in annotation["joints_camera_m"]) == len(HIPS)
    export(corpus, "itop", tmp_path / "itop", ("train",))
    with h5py.File(tmp_path / "itop" / "train_labels.h5") as labels:
        assert np.isnan(labels["real_world_coordinates"][:]).any(axis=2).sum(axis=1).tolist() == [len(HIPS)] * 14
        assert not labels["is_valid"][:].any()
    export(corpus, "webdataset", tmp_path / "tar", ("train",))
    export(corpus, "exr", tmp_path / "exr", ("train",))
