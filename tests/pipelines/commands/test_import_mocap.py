"""undergrowth import mocap: what is usable is imported, what is not is listed, splits stay apart."""

import json
import re

import numpy as np
import pytest

from pipelines import foreign
from pipelines.cli import main
from pipelines.commands.importing.mocap import MocapSettings
from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from pipelines.errors import UserError
from pipelines.importing.splits import SplitRule
from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.retarget import Retargeted
from synth.bodies.mocap.roles import joints_of
from synth.bodies.mocap.select import joint_places
from synth.bodies.poses.library import read_library
from synth.geometry import axis_angle
from tests.mocap_files import SIT, STAND, bvh_text, degrees, resting_root, standing_root, with_axes_anywhere
from tests.shared_data import SHARED

DATA = SHARED / "data" / "mocap"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"needs recordings in {DATA}")
LISTS = ["--train", "01", "--val", "02", "--test", "03"]


def recording(phase: float) -> str:
    """Someone stands and swings the arms, sits down at once, and moves them there."""
    frames = []
    for k in range(40):
        swing = degrees(l_shoulder_flexion=20 + 15 * np.sin(0.4 * k + phase), r_elbow_flexion=2.0 * k)
        angles = (STAND if k < 20 else SIT) + swing
        frames.append((angles, standing_root(angles)))
    return bvh_text(frames)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three good files among many bad ones."""
    root = tmp_path_factory.mktemp("mocap")
    good = recording(0.0)
    (root / "01_01.bvh").write_text(good)
    (root / "02_05_any.bvh").write_text(recording(1.0))
    (root / "sub").mkdir()
    (root / "sub" / "03_01.BVH").write_text(recording(2.0))
    (root / "01_01_again.bvh").write_text(good)
    (root / "a_text.bvh").write_text("once upon a time")
    (root / "b_bytes.bvh").write_bytes(bytes(range(256)))
    (root / "c_joints.bvh").write_text(good.replace("LeftUpLeg", "Thigh"))
    head, _, tail = good.partition("Frame Time: 0.033333\n")
    (root / "d_nan.bvh").write_text(f"{head}Frame Time: 0.033333\n" + re.sub(r"^\S+", "nan", tail, flags=re.M))
    (root / "e_zero.bvh").write_text(good[: good.index("Frames:")] + "Frames: 0\nFrame Time: 0.03\n")
    (root / "f_cut.bvh").write_text(good[: good.index("Frame Time") + 20])
    (root / "g_empty.bvh").write_text("")
    return root


@pytest.fixture(scope="module")
def lib(folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("lib") / "poses"
    assert main(["import", "mocap", str(folder), "--out", str(path), *LISTS]) == 0
    return path


def test_good_files_are_imported_and_bad_ones_listed_by_name(folder, tmp_path, capsys):
    assert main(["import", "mocap", str(folder), "--out", str(tmp_path / "p"), *LISTS]) == 0
    out = capsys.readouterr().out
    refused = [line for line in out.splitlines() if line.startswith("refused: ")]
    for name, reason in [
        ("01_01_again.bvh", "is trial 01_01 again, which was already read from 01_01.bvh"),
        ("a_text.bvh", "is not a BVH file"),
        ("b_bytes.bvh", "is not a BVH file"), ("c_joints.bvh", "LeftUpLeg (l_hip); it has Hips"),
        ("d_nan.bvh", "has no frame without NaN"), ("e_zero.bvh", "has 0 frames"),
        ("f_cut.bvh", "has no complete line of values"), ("g_empty.bvh", "is not a BVH file"),
    ]:  # fmt: skip
        assert any(name in line and reason in line for line in refused), name
    assert len(refused) == 8
    assert {trial.name for trial in read_library(tmp_path / "p").trials} == {"01_01", "02_05", "03_01"}


def test_the_library_stands_and_sits_in_every_split(lib):
    library = read_library(lib)
    for split in ("train", "val", "test"):
        assert len(library.rows(split, False)) >= 3
        assert len(library.rows(split, True)) >= 3
    assert not (library.frame == 0).any()  # the T-pose


def test_no_two_poses_of_a_subject_are_alike(lib):
    library = read_library(lib)
    for k in range(3):
        own = library.trial == k
        places = joint_places(Retargeted(library.angles[own].astype(float), library.root[own].astype(float)))
        apart = np.linalg.norm(places[:, None] - places[None], axis=3).max(axis=2)
        assert (apart + np.eye(len(places)) > 0.06 - 1e-4).all()


def test_the_same_files_give_the_same_bytes(folder, lib, tmp_path):
    assert main(["import", "mocap", str(folder), "--out", str(tmp_path / "p"), *LISTS]) == 0
    assert (tmp_path / "p").read_bytes() == lib.read_bytes()


def test_a_corpus_takes_its_poses_and_records_their_digest(lib, tmp_path, capsys):
    toml = tmp_path / "s.toml"
    toml.write_text(
        f'frames = 9\nposes = "{lib}"\nposes_share = 1.0\nposes_splits = ["test", "val"]\n'
        '[scene]\ncamera = "custom"\nintrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]\n'
    )
    assert main(["generate", str(tmp_path / "c"), "--config", str(toml)]) == 0
    corpus = Corpus.open(tmp_path / "c")
    assert list(faults(corpus)) == []
    kept = corpus.header.config["poses"]
    assert kept == {"digest": read_library(lib).digest, "share": 1.0, "splits": ["test", "val"]}
    infos = [corpus.info(i) for i in range(9)]
    assert all(info.pose_id.startswith("pose/" if info.split == "train" else "mocap/") for info in infos)
    assert "poses" not in json.loads((tmp_path / "c" / "corpus.json").read_text())["config"]["scene"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--poses", "none"], "there is no pose library none"),
        (["--poses", "LIB", "--poses-share", "2"], "share=2.0"),
        (["--poses", "BROKEN"], "is truncated, or no pose library"),
    ],
)
def test_a_library_that_cannot_be_used_is_one_line(lib, tmp_path, capsys, words, message):
    (tmp_path / "broken").write_bytes(lib.read_bytes()[:300])
    paths = {"LIB": str(lib), "BROKEN": str(tmp_path / "broken")}
    assert main(["generate", str(tmp_path / "c"), *(paths.get(word, word) for word in words)]) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    ("files", "words", "message"),
    [
        ({}, [], "has no .bvh files"),
        ({}, ["--mapping", "m.toml"], "cannot read m.toml: No such file"),
        ({"a.bvh": "no"}, [], "none of the 1 .bvh files"),
        ({"a.bvh": "no"}, ["--distance", "-1"], "distance=-1.0 must be a length of at least 0 m"),
        ({"a.bvh": "no"}, ["--distance", "inf"], "distance=inf must be a length of at least 0 m"),
        ({"a.bvh": "no"}, ["--train", "7", "--test", "7"], "7 is listed for train and for test"),
        (
            {"a.bvh": "no", "m.toml": "[joint]"},
            ["--mapping", "m.toml"],
            r"must have one table, [joints]; it has joint",
        ),
        (
            {"a.bvh": "no", "m.toml": "[joints]\nknee = 'x'"},
            ["--mapping", "m.toml"],
            "unknown roles knee; known are",
        ),
        ({"a.bvh": "no", "m.toml": "[joints]\nhips = 3"}, ["--mapping", "m.toml"], "hips=3 must be the name of"),
    ],
)
def test_what_cannot_be_imported_at_all_is_one_line(tmp_path, monkeypatch, capsys, files, words, message):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    assert main(["import", "mocap", ".", "--out", "p", *words]) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "p").exists()


def test_an_unknown_kind_of_import_lists_the_known(capsys):
    assert main(["import", "songs"]) == 2
    assert "unknown command 'import songs'; known are" in capsys.readouterr().err


def test_a_mapping_reads_joints_of_any_name(folder, lib, tmp_path):
    names = {}
    text = (folder / "01_01.bvh").read_text()
    for role, name in joints_of(parse_bvh(text))[0].joints.items():
        text = text.replace(f" {name}\n", f" x{role}\n")
        names[role] = f"x{role}"
    (tmp_path / "01_01.bvh").write_text(text)
    (tmp_path / "mine.toml").write_text("[joints]\n" + "\n".join(f'{r} = "{n}"' for r, n in names.items()))
    settings = MocapSettings(tmp_path, tmp_path / "p", tmp_path / "mine.toml", train=("01",))
    mapped, known = settings.library(), read_library(lib)
    assert np.array_equal(mapped.angles, known.angles[known.trial == 0])


def test_subjects_are_dealt_out_each_on_its_own_and_lists_go_first():
    dealt = {str(k): SplitRule(seed=0).split_of(str(k)) for k in range(2000)}
    shares = {split: sum(s == split for s in dealt.values()) / 2000 for split in ("train", "val", "test")}
    assert shares == pytest.approx({"train": 0.7, "val": 0.1, "test": 0.2}, abs=0.03)
    assert SplitRule(val=("5",)).split_of("5") == "val"
    assert dealt != {str(k): SplitRule(seed=1).split_of(str(k)) for k in range(2000)}


@needs_data
def test_the_same_trial_in_two_conventions_gives_nearly_the_same_poses():
    from synth.bodies.mocap.bvh import parse_bvh
    from synth.bodies.mocap.retarget import retarget
    from synth.bodies.mocap.source import read_source

    for trial in ("02_06", "05_12", "12_01"):
        a, b = (
            joint_places(retarget(read_source(parse_bvh((DATA / f"{trial}_{kind}.bvh").read_text()))))[1:]
            for kind in ("daz", "mb")
        )
        assert np.median(np.linalg.norm(a - b, axis=2)) < 0.02


@needs_data
@pytest.mark.parametrize("name", ["12_01_mb", "12_01_daz", "14_31_daz"])
def test_without_their_t_pose_recordings_give_nearly_the_same_poses(name):
    from synth.bodies.mocap.retarget import retarget
    from synth.bodies.mocap.source import read_source, read_source_from_positions

    bvh = parse_bvh((DATA / f"{name}.bvh").read_text())
    tangle = with_axes_anywhere(bvh, np.random.default_rng(0))
    truth = joint_places(retarget(read_source(bvh)))[1:]
    for given, limit in ((bvh, 0.03), (tangle, 0.06)):
        places = joint_places(retarget(read_source_from_positions(given)))[1:]
        assert np.median(np.linalg.norm(places - truth, axis=2)) < limit


@needs_data
def test_people_on_stools_sit_and_people_who_walk_stand(tmp_path):
    for name in ("13_01_daz", "14_31_daz", "12_01_daz"):
        (tmp_path / f"{name}.bvh").write_bytes((DATA / f"{name}.bvh").read_bytes())
    library = MocapSettings(tmp_path, tmp_path / "p").library()
    share = {
        trial.name: float(library.is_sitting[library.trial == k].mean()) for k, trial in enumerate(library.trials)
    }
    assert share["12_01"] == 0.0
    assert share["13_01"] > 0.1
    assert share["14_31"] > 0.2


def test_fast_recordings_are_thinned_to_the_frames_of_slow_ones_and_cut_ones_told(tmp_path, caplog):
    slow = recording(0.0)
    head, _, tail = slow.partition("Frame Time: 0.033333\n")
    lines = tail.splitlines()
    fast = head.replace("Frames: 41", "Frames: 200") + "Frame Time: 0.008333\n"
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    (tmp_path / "a" / "05_01.bvh").write_text(slow)
    (tmp_path / "b" / "05_01.bvh").write_bytes(
        b"\xef\xbb\xbf" + (fast + "\n".join(line for line in lines for _ in range(4))).encode()
    )
    caplog.set_level("WARNING", "pipelines")
    ours, theirs = (MocapSettings(tmp_path / name, tmp_path / "lib").library() for name in "ba")
    assert (ours.angles == theirs.angles).all()
    assert (ours.frame == 4 * theirs.frame).all()
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path / 'b' / '05_01.bvh'} was cut off: it has 164 of 200 frames"
    ]


def test_frames_with_nan_and_files_without_a_t_pose_are_imported_and_told(tmp_path, caplog):
    whole = recording(0.0).splitlines()
    lines = whole.copy()
    lines[-5] = "nan " + lines[-5].partition(" ")[2]
    first = lines.index("Frame Time: 0.033333") + 1
    bent = bvh_text([(STAND, standing_root(STAND))] * 3, rest=STAND)
    for name, text in (("a", "\n".join(whole)), ("b", "\n".join(lines)), ("c", bent)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "05_01.bvh").write_text(text)
    caplog.set_level("INFO", "pipelines")
    ours, theirs, _ = (MocapSettings(tmp_path / name, tmp_path / "lib", distance=0.0).library() for name in "bac")
    assert set(theirs.frame) - set(ours.frame) == {len(whole) - 5 - first}
    told = [record.getMessage() for record in caplog.records]
    assert f"{tmp_path / 'b' / '05_01.bvh'}: NaN or infinity in 1 of 41 frames, which are dropped" in told
    words = "has no T-pose: limb directions are taken from joint positions"
    assert [line for line in told if "T-pose:" in line] == [f"{tmp_path / 'c' / '05_01.bvh'} {words}"]


def test_a_pattern_puts_all_subjects_into_a_split(folder, tmp_path):
    library = MocapSettings(folder, tmp_path / "lib", test=("*",)).library()
    assert {trial.split for trial in library.trials} == {"test"}
    library = MocapSettings(folder, tmp_path / "lib", val=("02",), test=("0[13]",)).library()
    assert {trial.subject: trial.split for trial in library.trials} == {"01": "test", "02": "val", "03": "test"}


def take(frames: list[tuple[np.ndarray, np.ndarray]]) -> str:
    upright = [(STAND, standing_root(STAND))] * 8
    return bvh_text(upright + frames + upright)


def test_what_became_of_every_frame_is_told(tmp_path, caplog):
    lying = resting_root(STAND, axis_angle((0.0, 1.0, 0.0), -1.5))
    air = standing_root(STAND)
    air[2, 3] += 0.4
    beyond = STAND + degrees(l_shoulder_abduction=50.0, l_elbow_flexion=-60.0, l_knee_flexion=-45.0)
    frames = [(STAND, lying)] * 9 + [(STAND, air)] * 7 + [(beyond, standing_root(beyond))] * 5
    (tmp_path / "take.bvh").write_text(take(frames + [(SIT, standing_root(SIT))] * 20))
    caplog.set_level("INFO", "pipelines")
    library = MocapSettings(tmp_path, tmp_path / "p", test=("*",)).library()
    told = next(line for line in caplog.messages if "take.bvh" in line)
    for words in ("58 frames", "  1 T-poses", "  9 on the floor", "  7 unsupported", "  5 out of reach"):
        assert words in told
    assert library.is_sitting.tolist() == [False, True]


def test_each_file_that_is_junk_is_one_line_and_the_others_are_imported(tmp_path, capsys):
    good = recording(0.0)
    head, mark, values = good.partition("MOTION\n")
    files = {
        "channels": head.replace("CHANNELS 3", "CHANNELS 1000000000") + mark + values,
        "commas": head + mark + values.replace(".", ",", 5),
        "short": good.rstrip().rpartition(" ")[0],
        "nested": "HIERARCHY\n" + "ROOT a\n{\n" * 5000 + "MOTION\nFrames: 1\nFrame Time: 0.1\n1\n",
        "flat": re.sub("OFFSET .*", "OFFSET 0 0 0", head) + mark + values,
        "empty": "",
        "none": head + mark + "Frames: 0\nFrame Time: 0.1\n",
    }  # fmt: skip
    for name, text in files.items():
        (tmp_path / f"{name}.bvh").write_text(text)
    (tmp_path / "folder.bvh").mkdir()
    (tmp_path / "gone.bvh").symlink_to(tmp_path / "nowhere")
    (tmp_path / "good.bvh").write_text(good.replace("Frames: 41", "Frames: 1000000000"))
    assert main(["import", "mocap", str(tmp_path), "--out", str(tmp_path / "p"), "--test", "*"]) == 0
    captured = capsys.readouterr()
    refused = [line for line in captured.out.splitlines() if line.startswith("refused: ")]
    names = {line.split(".bvh")[0].rpartition("/")[2] for line in refused}
    assert names == {*files, "folder", "gone"}
    assert "Traceback" not in captured.out + captured.err
    assert "good.bvh was cut off: it has 41 of 1000000000 frames" in captured.out
    assert "good.bvh" in {trial.file for trial in read_library(tmp_path / "p").trials}


def test_a_file_that_would_take_too_much_memory_is_refused_unread(tmp_path, monkeypatch, capsys):
    (tmp_path / "large.bvh").write_text(recording(0.0))
    monkeypatch.setattr(foreign, "MAX_BYTES", 100_000)
    assert main(["import", "mocap", str(tmp_path), "--out", str(tmp_path / "p")]) == 1
    assert "large.bvh: its text would take" in capsys.readouterr().out


def test_people_in_folders_and_files_with_dates_are_kept_apart(tmp_path):
    for k, name in enumerate(("anna/2023_05_12_take1", "anna/2023_05_12_take2", "ben/2023_05_12_take1")):
        path = tmp_path / f"{name}.bvh"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(re.sub("(ROOT|JOINT) ", r"\1 Müller_", recording(float(k))).encode("latin-1"))
    library = MocapSettings(tmp_path, tmp_path / "p", val=("anna",), test=("ben",)).library()
    assert [(trial.subject, trial.split) for trial in library.trials] == [("anna", "val")] * 2 + [("ben", "test")]
    by_name = MocapSettings(tmp_path, tmp_path / "p", subject_from="name")
    with pytest.raises(UserError, match="none of the 3"):
        by_name.library()
