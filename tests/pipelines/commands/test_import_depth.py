"""Recorded depth becomes a corpus: readers, labels along the surface, splits, unknown joints, bad input."""

import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from toy_recording import (
    ANNOTATION,
    CAMERA,
    LAYOUT,
    NAMES,
    imported,
    silhouette,
    standing,
    write_layout,
    write_recording,
)

from pipelines.cli import main
from pipelines.commands.importing.depth import DepthSettings
from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from pipelines.corpus.laws import broken_laws
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import UserError
from pipelines.importing.depth import parse_shares
from pipelines.metrics import read_truths
from pipelines.metrics.groups import by_state
from pipelines.recordings import geodesic
from pipelines.recordings.bones import bones_of
from pipelines.recordings.foreground import cut_out, drop_blobs
from pipelines.recordings.layout import Box, Layout, known_layouts, read_layout
from pipelines.recordings.readers import read_image
from synth.vocabulary import JOINT_NAMES, PART_NAMES, JointState
from tests.shared_data import SHARED

REAL = SHARED / "data" / "real"
SMALL = ["--n-trees", "1", "--growth.max-depth", "4", "--growth.n-candidates", "20"]


@pytest.fixture
def folder(tmp_path):
    return write_recording(tmp_path / "recording")


def test_a_recording_becomes_a_sound_corpus_with_its_joints_and_order(folder):
    corpus = imported(folder, write_layout(folder))
    assert list(faults(corpus)) == []
    assert (corpus.split("test") == np.arange(10)).all()
    np.testing.assert_allclose(corpus[3].joints, standing(0.03), atol=1e-6)
    assert (corpus[3].depth == silhouette(standing(0.03))).all()
    assert (corpus[3].joint_state == JointState.VISIBLE).sum() >= 12
    assert (corpus[3].part > 0).sum() == (corpus[3].depth > 0).sum()


def test_labels_lie_where_the_joints_are_and_right_is_the_persons_right(folder):
    frame = imported(folder, write_layout(folder))[0]
    for joint, part in {"r_hand": "r_hand", "l_hand": "l_hand", "r_knee": "r_knee", "l_knee": "l_knee"}.items():
        u, v = np.rint(frame.joints_2d[JOINT_NAMES.index(joint)]).astype(int)
        assert PART_NAMES[frame.part[v, u]] == part
    lowest = np.flatnonzero(frame.part.any(axis=1))[-1]
    assert {PART_NAMES[label] for label in frame.part[lowest]} == {"background", "l_foot", "r_foot"}
    u = {name: np.nonzero(frame.part == PART_NAMES.index(name))[1].mean() for name in ("lu_torso", "ru_torso")}
    assert u["ru_torso"] < u["lu_torso"]


def test_unknown_joints_have_no_place_and_are_skipped_by_metrics(folder):
    known = [name for name in NAMES if not name.endswith("_hip")]
    corpus = imported(folder, write_layout(folder, joints=known), splits="train=0.5,val=0.5")
    hips = [JOINT_NAMES.index(name) for name in ("r_hip", "l_hip")]
    assert list(faults(corpus)) == []
    assert (corpus.arrays("joint_state")[:, hips] == JointState.UNKNOWN).all()
    assert np.isnan(corpus.arrays("joints")[:, hips]).all()
    assert np.isnan(corpus[0].joints_2d[hips]).all()
    assert np.isfinite(np.delete(corpus.arrays("joints"), hips, axis=1)).all()
    assert np.isnan(CorpusFrames(corpus, corpus.indices)[0].joints[hips]).all()
    truths = read_truths(corpus, corpus.indices)
    assert np.isnan(truths.xyz[:, hips]).all()
    assert np.isfinite(np.delete(truths.xyz, hips, axis=1)).all()
    assert not any(group[:, hips].any() for name, group in by_state(truths).items() if name != "non_occluded")
    moved = replace(corpus[0], joints=np.ones((15, 3), np.float32))
    assert any("unknown joint" in sentence for sentence in broken_laws(moved, corpus.header))


@pytest.mark.parametrize("kind", ["oarf", "rwf"])
def test_training_learns_the_joints_that_recordings_tell(folder, kind, capsys):
    """Evaluation neither asks for the others nor counts an answer to them."""
    known = [name for name in NAMES if not name.endswith("_hip")]
    corpus = imported(folder, write_layout(folder, joints=known), splits="train=0.6,val=0.2,test=0.2")
    whole = imported(folder, write_layout(folder), folder.parent / "whole", splits="train=0.6,val=0.2,test=0.2")
    model, options = folder / "model.safetensors", SMALL + {"oarf": [], "rwf": ["--n-points", "20"]}[kind]
    assert main(["train", kind, str(corpus.path), "--out", str(model), *options]) == 0
    told = capsys.readouterr().out
    assert "are not learned: r_hip, l_hip" in told
    assert ("no training frame shows an object" in told) == (kind == "oarf")
    scores = []
    for scored in (corpus, whole):
        assert main(["evaluate", str(model), str(scored.path), "--json", "--resamples", "10"]) == 0
        scores.append(json.loads(capsys.readouterr().out))
    if kind == "oarf":
        assert [each["n_joints"] for each in scores] == [26, 30]
        assert [each["by_joint"]["r_hip"]["missing"] for each in scores] == [None, 1.0]
    else:
        assert [each["n_joints"] for each in scores] == [26, 26]
        assert not any("r_hip" in each["by_joint"] for each in scores)
    assert len({each["by_joint"]["head"]["mean_error_cm"] for each in scores}) == 1
    has_size = [each["by_joint"]["head"]["accuracy_2d"] is not None for each in scores]
    assert has_size == [False, True]


def test_a_model_of_all_joints_is_scored_on_those_that_are_told(folder, capsys):
    corpus = imported(folder, write_layout(folder, joints=["head"]), splits="train=0.5,val=0,test=0.5")
    whole = imported(folder, write_layout(folder), folder.parent / "whole", splits="train=0.5,val=0,test=0.5")
    model = folder / "model.safetensors"
    assert main(["train", "oarf", str(whole.path), "--out", str(model), *SMALL]) == 0
    capsys.readouterr()
    assert main(["evaluate", str(model), str(corpus.path), "--json", "--resamples", "10"]) == 0
    scores = json.loads(capsys.readouterr().out)
    assert scores["n_joints"] == scores["by_joint"]["head"]["n_joints"] == 5
    assert scores["by_joint"]["l_foot"]["n_joints"] == 0
    assert scores["missing"] == 0.0


@pytest.mark.parametrize("kind", ["oarf", "rwf"])
def test_recordings_without_joints_cannot_be_trained_on(folder, kind, capsys):
    corpus = imported(folder, write_layout(folder, joints=[]), splits="train=1")
    assert main(["train", kind, str(corpus.path), "--out", str(folder / "model.safetensors")]) == 1
    assert "no joint is known in its training frames" in capsys.readouterr().err.splitlines()[-1]


def test_without_joints_pixels_have_depth_and_no_label(folder):
    corpus = imported(folder, write_layout(folder, joints=[]))
    assert list(faults(corpus)) == []
    frame = corpus[0]
    assert frame.depth.any()
    assert not frame.part.any()
    assert (frame.joint_state == JointState.UNKNOWN).all()


def test_splits_follow_the_order_and_subjects_are_apart(folder):
    corpus = imported(folder, write_layout(folder), splits="train=0.5,val=0,test=0.5")
    assert corpus.split("train").tolist() == [0, 1, 2, 3, 4]
    assert corpus.split("test").tolist() == [5, 6, 7, 8, 9]
    assert corpus.info(0).subject_id != corpus.info(9).subject_id


@pytest.mark.parametrize("text", ["train=0.5", "train=a,test=1", "all=1", "train=-1,test=2"])
def test_shares_that_are_none_are_refused(text):
    with pytest.raises(UserError, match="splits="):
        parse_shares(text)


def test_every_takes_one_frame_of_so_many_and_bytes_do_not_depend_on_workers(folder, bytes_of):
    layout = write_layout(folder)
    one = imported(folder, layout, every=3)
    assert [one.info(i).pose_id for i in range(4)] == [f"layout/d_{n}" for n in (5, 8, 11, 14)]
    other = imported(folder, layout, folder.parent / "other", every=3, workers=2)
    assert bytes_of(one.path) == bytes_of(other.path)


@pytest.mark.parametrize("big_endian", [False, True])
def test_all_formats_give_the_same_depth(tmp_path, big_endian):
    depth = silhouette(standing())
    layout = Layout("*", "raw", 64, 48, known_layouts()["itop"].camera, big_endian=big_endian)
    cv2.imwrite(str(tmp_path / "d.png"), depth)
    np.save(tmp_path / "d.npy", depth / 1000.0)
    depth.astype(">u2" if big_endian else "<u2").tofile(tmp_path / "d.raw")
    v, u = np.indices(depth.shape)
    cloud = np.stack([u, v, np.where(depth > 0, depth / 1000.0, np.nan)], axis=2).reshape(-1, 3)
    head = (
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 64\nHEIGHT 48\nPOINTS 3072\nDATA "
    )
    text = "\n".join(" ".join(f"{v:.4f}" for v in row) for row in cloud)
    fields = cloud.astype("<f4").T.tobytes()
    literals = b"".join(
        bytes([len(fields[i : i + 32]) - 1]) + fields[i : i + 32] for i in range(0, len(fields), 32)
    )
    bodies = {
        "ascii": text.encode(),
        "binary": cloud.astype("<f4").tobytes(),
        "binary_compressed": np.array([len(literals), len(fields)], "<u4").tobytes() + literals,
    }
    for way, body in bodies.items():
        (tmp_path / f"{way}.pcd").write_bytes(head.encode() + way.encode() + b"\n" + body)
    for path in sorted(tmp_path.iterdir()):
        is_raw = path.suffix == ".raw"
        image = read_image(path, layout if is_raw else replace(layout, format=path.suffix[1:], big_endian=False))
        assert (image == depth).all(), path.name


def test_packed_copies_repeat_what_was_written():
    from pipelines.recordings.formats.pcd import _unpack

    out = np.empty(8, np.uint8)
    # Two literals 7 and 9, then six bytes from two places back.
    assert _unpack(np.array([1, 7, 9, (4 << 5), 1], np.uint8), out) == 8
    assert out.tolist() == [7, 9] * 4
    assert _unpack(np.array([(4 << 5), 1], np.uint8), out) == -1


def nearest_along_the_surface(depth, distance, camera):
    """The obvious twin of the labels' spreading: shortest paths from each seed by scipy."""
    v, u = np.nonzero(depth)
    points = camera.backproject(np.stack([u, v], axis=1), depth[v, u] / 1000.0)
    mm = depth[v, u].astype(int)
    touch = (np.abs(v[:, None] - v) <= 1) & (np.abs(u[:, None] - u) <= 1) & (np.abs(mm[:, None] - mm) <= 60)
    a, b = np.nonzero(touch)
    step = np.linalg.norm(points[a] - points[b], axis=1)
    seeds = np.flatnonzero(np.isfinite(distance[v, u]))
    graph = coo_array((step + 1e-12, (a, b)), shape=(len(v), len(v)))
    return v, u, (dijkstra(graph, indices=seeds) + distance[v, u][seeds][:, None]).min(axis=0)


def test_distances_along_the_surface_equal_scipys():
    rng = np.random.default_rng(5)
    depth = np.where(silhouette(standing()) > 0, 1950 + rng.integers(-45, 45, (48, 64)), 0).astype(np.uint16)
    bones = bones_of(standing())
    intrinsics = (60.0, 60.0, 31.5, 23.5)
    points = geodesic._lift(depth, intrinsics)
    distance, bone = np.full(depth.shape, np.inf), np.full(depth.shape, -1, np.int16)
    geodesic._seed(points, bones, intrinsics, distance, bone)
    v, u, expected = nearest_along_the_surface(depth, distance.copy(), CAMERA)
    geodesic._spread(depth, points, distance, bone)
    np.testing.assert_allclose(distance[v, u], expected, atol=1e-9)


def test_an_arm_before_the_trunk_keeps_its_label():
    joints = standing()
    hand, elbow = JOINT_NAMES.index("l_hand"), JOINT_NAMES.index("l_elbow")
    depth = silhouette(joints)
    joints[elbow], joints[hand] = (0.3, -0.1, 1.7), (0.0, -0.1, 1.6)
    depth[20:23, 30:43] = 1570
    part = geodesic.label_parts(depth, bones_of(joints), CAMERA)
    arm = {PART_NAMES.index(name) for name in ("l_elbow", "lw_arm", "l_wrist", "l_hand")}
    assert set(part[20:23, 30:43].ravel().tolist()) <= arm
    assert ((part > 0) == (depth > 0)).all()


def test_stray_blobs_go_and_boxes_cut():
    depth = np.zeros((20, 20), np.uint16)
    depth[2:12, 2:12], depth[15, 15] = 1000, 2000
    assert drop_blobs(depth, 0.02)[15, 15] == 0
    assert (drop_blobs(depth, 0.0) == depth).all()
    assert (drop_blobs(depth, 0.02)[2:12, 2:12] == 1000).all()
    cut = cut_out(depth, Box((0, 0, 5, 20), 0.5, 1.5))
    assert np.count_nonzero(cut) == 30
    assert not drop_blobs(np.zeros((3, 3), np.uint16), 0.5).any()


def _eight_bits(folder):
    cv2.imwrite(str(folder / "d_7.png"), np.zeros((48, 64), np.uint8))


def _other_size(folder):
    cv2.imwrite(str(folder / "d_7.png"), np.ones((10, 20), np.uint16))


def _empty(folder):
    cv2.imwrite(str(folder / "d_7.png"), np.zeros((48, 64), np.uint16))


def _fewer_joints(folder):
    np.savetxt(folder / "j_7.txt", np.ones((12, 3)))


def _no_number(folder):
    np.savetxt(folder / "j_7.txt", np.full((15, 3), np.nan))


def _no_joints(folder):
    (folder / "j_7.txt").unlink()


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (_eight_bits, r"d_7.png has 8 bits a pixel, must have at least 16"),
        (_other_size, r"d_7.png has 20x10 pixels, but the layout says 64x48"),
        (_empty, r"d_7.png shows no person"),
        (_fewer_joints, r"j_7.txt holds joints of shape \(12, 3\), but the layout says \(15, 3\)"),
        (_no_number, r"j_7.txt: joint head is .*nan.*must be finite"),
        (_no_joints, r"d_7.png has no joints"),
    ],
)
def test_a_bad_frame_is_left_out_with_the_reason_and_the_others_are_imported(folder, spoil, reason, capsys):
    spoil(folder)
    out = folder.parent / "corpus"
    assert main(["import", "depth", str(folder), "--layout", write_layout(folder), "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert re.search(f"left out: .*{reason}", told)
    assert "9 frames in" in told
    assert "1 of 10 were left out" in told
    corpus = Corpus.open(out)
    assert [corpus.info(i).pose_id for i in range(9)] == [f"layout/d_{n}" for n in (5, 6, *range(8, 15))]
    assert corpus.header.config["import"]["left_out"] == 1
    assert list(faults(corpus)) == []


def test_frames_that_are_left_out_are_the_same_on_every_run(folder, bytes_of):
    _empty(folder)
    layout = write_layout(folder)
    one = imported(folder, layout)
    for workers, name in ((2, "other"), (1, "again"), (1, "again")):
        words = ["--layout", layout, "--out", str(folder.parent / name), "--workers", str(workers)]
        assert main(["import", "depth", str(folder), *words]) == 0
    assert bytes_of(one.path) == bytes_of(folder.parent / "other") == bytes_of(folder.parent / "again")


def test_a_folder_without_a_usable_frame_is_refused_with_the_first_reason(folder):
    for path in folder.glob("d_*.png"):
        cv2.imwrite(str(path), np.zeros((48, 64), np.uint16))
    with pytest.raises(UserError, match=r"no frame that can be used; the first of 10: .*d_5.png shows no person"):
        DepthSettings(folder, folder.parent / "out", write_layout(folder)).order()


def test_truncated_raw_and_hdf5_without_keys_are_named(tmp_path):
    (tmp_path / "d.raw").write_bytes(b"\0" * 100)
    layout = Layout("*", "raw", 64, 48, known_layouts()["itop"].camera)
    with pytest.raises(UserError, match=r"d.raw has 100 bytes; 64x48 pixels of 16 bits have 6144"):
        read_image(tmp_path / "d.raw", layout)
    import h5py

    for name in ("a_depth_map.h5", "a_labels.h5"):
        with h5py.File(tmp_path / name, "w") as file:
            file["other"] = 1
    with pytest.raises(UserError, match=r"the first of 1: .*a_depth_map.h5 has no array 'data'; it has other"):
        DepthSettings(tmp_path, tmp_path / "out").order()


def test_layouts_are_found_by_contents_and_the_known_are_listed(tmp_path):
    with pytest.raises(UserError, match=r"no known layout.*eval_a.*five_people.*itop.*skeltrack"):
        DepthSettings(tmp_path, tmp_path / "out").order()
    with pytest.raises(UserError, match="layout 'itopp' is unknown; known are"):
        DepthSettings(tmp_path, tmp_path / "out", "itopp").order()
    path = tmp_path / "bad.toml"
    path.write_text(LAYOUT.format(format="png") + ANNOTATION.format(names='["a"]', joints='nose = "a"'))
    with pytest.raises(UserError, match="joint 'nose' is unknown"):
        read_layout(path)


@pytest.mark.parametrize(("name", "n_frames"), [("eval_a", 3), ("skeltrack", 12), ("five_people", 5)])
def test_real_recordings_import_soundly(tmp_path, name, n_frames):
    if not (REAL / name).is_dir():
        pytest.skip(f"needs the recordings {REAL / name}")
    corpus = imported(REAL / name, None, tmp_path / "out", every=1000 if name == "eval_a" else 1)
    assert len(corpus) == n_frames
    assert list(faults(corpus)) == []
