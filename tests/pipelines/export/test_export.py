"""Each export says the same as the corpus when read by the library that its users have."""

import json

import cv2
import h5py
import numpy as np
import pytest

from pipelines.cli import main
from pipelines.errors import UserError
from pipelines.export.coco import run_lengths
from pipelines.export.itop import ITOP_JOINTS, SEGMENT_OF_PART
from pipelines.export.write import EXPORTERS, export
from synth.vocabulary import BONES, JOINT_NAMES, OCCLUDER_CLASSES, PART_NAMES

THEIR_WARNINGS = pytest.mark.filterwarnings("ignore::DeprecationWarning")
"""pycocotools uses numpy in a way that numpy means to drop."""
MAPS = ("depth", "part", "occluder", "instance", "body_depth", "body_part")


def test_exr_channels_come_back_with_their_names(toy_corpus, tmp_path):
    import OpenEXR

    assert export(toy_corpus, "exr", tmp_path / "out", ("val",)) == 30
    files = sorted((tmp_path / "out" / "val").iterdir())
    assert [int(path.stem) for path in files] == toy_corpus.split("val").tolist()
    frame = toy_corpus[int(files[3].stem)]
    with OpenEXR.File(str(files[3]), separate_channels=True) as file:
        channels, header = file.channels(), file.header()
        for name, expected in (("Z", frame.depth), ("body.Z", frame.body_depth)):
            pixels = channels[name].pixels
            assert pixels.dtype == np.float32
            np.testing.assert_array_equal(np.rint(pixels * 1000).astype(np.uint16), expected)
        for name, expected in (
            ("part.id", frame.part),
            ("body.part.id", frame.body_part),
            ("occluder.id", frame.occluder),
            ("instance.id", frame.instance),
        ):
            assert channels[name].pixels.dtype == np.uint32
            np.testing.assert_array_equal(channels[name].pixels, expected)
        manifest = header["idManifest"]
        names = {}
        for k in range(manifest.size()):
            names[next(iter(manifest[k].getChannels()))] = {entry.id(): entry.text()[0] for entry in manifest[k]}
        assert names["part.id"] == dict(enumerate(PART_NAMES))
        assert names["occluder.id"] == dict(enumerate(OCCLUDER_CLASSES))
        assert names["instance.id"] == {0: "none"} | {o.instance: o.spec_id for o in frame.info.objects}
        joints = np.array(header["undergrowth:joints"].split(), dtype=np.float32).reshape(15, 3)
        np.testing.assert_array_equal(joints, frame.joints)


@THEIR_WARNINGS
def test_coco_is_read_by_pycocotools(toy_corpus, tmp_path, capsys):
    from pycocotools.coco import COCO

    export(toy_corpus, "coco", tmp_path / "out")
    for split in ("train", "val", "test"):
        coco = COCO(str(tmp_path / "out" / "annotations" / f"{split}.json"))
        assert sorted(coco.getImgIds()) == toy_corpus.split(split).tolist()
    capsys.readouterr()
    category = coco.loadCats(1)[0]
    assert category["keypoints"] == list(JOINT_NAMES)
    assert category["skeleton"] == [[a + 1, b + 1] for a, b in BONES]
    for image in coco.loadImgs(coco.getImgIds())[:6]:
        frame = toy_corpus[image["id"]]
        (annotation,) = coco.loadAnns(coco.getAnnIds(imgIds=image["id"]))
        mask = coco.annToMask(annotation)
        np.testing.assert_array_equal(mask, frame.part > 0)
        assert annotation["area"] == mask.sum()
        left, top, width, height = annotation["bbox"]
        rows, columns = np.nonzero(mask)
        assert (left, top) == (columns.min(), rows.min())
        assert (left + width - 1, top + height - 1) == (columns.max(), rows.max())
        keypoints = np.array(annotation["keypoints"]).reshape(15, 3)
        np.testing.assert_array_equal(keypoints[:, 2], np.array([2, 1, 1, 0])[frame.joint_state])
        shown = keypoints[:, 2] > 0
        np.testing.assert_allclose(keypoints[shown, :2], frame.joints_2d[shown], atol=6e-4)
        assert not keypoints[~shown].any()
        assert annotation["num_keypoints"] == shown.sum()
        for name in MAPS:
            path = tmp_path / "out" / image["file_name"].replace("depth", name, 1)
            pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            assert pixels.dtype == getattr(frame, name).dtype
            np.testing.assert_array_equal(pixels, getattr(frame, name))


@THEIR_WARNINGS
def test_run_lengths_agree_with_pycocotools():
    from pycocotools import mask as tools

    rng = np.random.default_rng(1)
    masks = [rng.random((7, 5)) < share for share in (0.0, 0.3, 0.7, 1.0)]
    for mask in masks:
        code = run_lengths(mask)
        np.testing.assert_array_equal(tools.decode(tools.frPyObjects(code, 7, 5)), mask)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_webdataset_is_read_by_webdataset(toy_corpus, tmp_path):
    import webdataset

    export(toy_corpus, "webdataset", tmp_path / "out", ("test",))
    (tar,) = (tmp_path / "out").iterdir()
    samples = list(webdataset.WebDataset(str(tar), shardshuffle=False).decode())
    assert [int(sample["__key__"]) for sample in samples] == toy_corpus.split("test").tolist()
    for sample in samples[:5]:
        frame = toy_corpus[int(sample["__key__"])]
        np.testing.assert_array_equal(sample["joints.npy"], frame.joints)
        assert sample["json"]["subject_id"] == frame.info.subject_id
        assert sample["json"]["joint_state"] == frame.joint_state.tolist()
        for name in MAPS:
            pixels = cv2.imdecode(np.frombuffer(sample[f"{name}.png"], np.uint8), cv2.IMREAD_UNCHANGED)
            np.testing.assert_array_equal(pixels, getattr(frame, name))


def test_exports_as_tar_have_the_same_bytes_each_time(toy_corpus, tmp_path, bytes_of):
    for name in ("a", "b"):
        export(toy_corpus, "webdataset", tmp_path / name, ("val",))
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")


def test_itop_is_read_by_h5py(toy_corpus, tmp_path):
    export(toy_corpus, "itop", tmp_path / "out", ("test",))
    numbers = toy_corpus.split("test")
    with (
        h5py.File(tmp_path / "out" / "test_depth_map.h5") as maps,
        h5py.File(tmp_path / "out" / "test_labels.h5") as labels,
    ):
        assert maps["data"].dtype == np.float16
        assert maps["data"].shape == (len(numbers), 48, 64)
        assert set(labels) == {
            "id", "image_coordinates", "is_valid", "real_world_coordinates", "segmentation", "visible_joints",
        }  # fmt: skip
        assert tuple(labels.attrs["joints"]) == ITOP_JOINTS
        assert labels.attrs["left_and_right"] == "the person's own"
        np.testing.assert_array_equal(maps["id"][:], labels["id"][:])
        row = 4
        frame = toy_corpus[int(numbers[row])]
        assert labels["id"][row].decode().split("_")[1] == f"{numbers[row]:05d}"
        np.testing.assert_allclose(maps["data"][row], frame.depth * 0.001, atol=0.002)
        for k, name in enumerate(ITOP_JOINTS):
            ours = JOINT_NAMES.index(name)
            x, y, z = labels["real_world_coordinates"][row, k]
            np.testing.assert_array_equal([x, -y, z], frame.joints[ours])
            np.testing.assert_allclose(labels["image_coordinates"][row, k], frame.joints_2d[ours], atol=0.5)
            assert labels["visible_joints"][row, k] == (frame.joint_state[ours] == 0)
        np.testing.assert_array_equal(labels["segmentation"][row], SEGMENT_OF_PART[frame.part])
        assert labels["is_valid"][:].all()


def test_itop_segments_keep_sides_and_regions():
    segments = {part: ITOP_JOINTS[SEGMENT_OF_PART[label]] for label, part in enumerate(PART_NAMES) if label}
    assert SEGMENT_OF_PART[0] == -1
    assert segments["lu_arm"] == "l_shoulder"
    assert segments["rw_arm"] == "r_elbow"
    assert segments["l_wrist"] == "l_hand"
    assert segments["rw_leg"] == "r_knee"
    assert segments["lw_head"] == "head"
    assert set(segments.values()) == set(ITOP_JOINTS)


def test_an_export_is_whole_or_absent(toy_corpus, tmp_path, monkeypatch):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").write_text("mine")
    with pytest.raises(UserError, match="is not empty"):
        export(toy_corpus, "coco", tmp_path / "full")

    def fail(job):
        (job.folder / "half").write_text("x")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(EXPORTERS, "coco", fail)
    with pytest.raises(UserError, match=r"the disk that holds .* is full"):
        export(toy_corpus, "coco", tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["full"]


def test_the_annotations_are_plain_json(toy_corpus, tmp_path):
    assert (
        main(["export", str(toy_corpus.path), "--to", "coco", "--out", str(tmp_path / "o"), "--split", "val"]) == 0
    )
    document = json.loads((tmp_path / "o" / "annotations" / "val.json").read_text())
    assert len(document["images"]) == 30
