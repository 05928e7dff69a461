"""An ablation's scores, a run as a user starts it, killed and gone on with."""

import json

import numpy as np
import pytest
from toy_libraries import objects_of, poses_of
from toy_results import results_of, truths_of

from forests.estimate import JointEstimate
from pipelines.ablate import run as ablate_run
from pipelines.ablate.config import load_config
from pipelines.ablate.folder import ResultsFolder
from pipelines.ablate.jobs import Selection
from pipelines.ablate.plan import make_plan
from pipelines.ablate.table import GROUPS, Resampling, pair_scores, row_scores
from pipelines.cli import main
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.metrics import MEASURES, compare, draw_frames, read_truths, summarise
from pipelines.metrics.results import read_results
from pipelines.models.asking import Contestant, predict_frames
from pipelines.models.checkpoints import TreeFolder
from synth.bodies.poses import library
from synth.occluders import meshlib
from synth.vocabulary import JOINT_NAMES

TINY = """
rows = ["baseline", "occluders", "semantic", "rwf"]
n_seeds = { oarf = 2 }
n_resamples = 50
tree_counts = [1, 2]
pixel_counts = [20, 50]

[corpus]
train_frames = 10
val_frames = 3
test_frames = 6
seed = 3

[corpus.scene]
camera = "custom"
intrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]

[oarf]
n_trees = 2
n_pixels = 60
n_occluder_pixels = 60
n_voting_pixels = 50
growth = { max_depth = 6, n_candidates = 20, n_finalists = 5 }

[rwf]
joints = ["head", "neck", "torso", "r_shoulder", "l_shoulder"]
n_points = 30
growth = { max_depth = 5, n_candidates = 20, n_finalists = 5 }
"""

# Scores


def test_scores_of_one_seed_are_those_of_the_metrics():
    truths = truths_of()
    results = results_of(truths)
    weights = draw_frames(len(truths), 40, np.random.default_rng(0))
    scores = row_scores([results], weights)
    summary = summarise(results, np.ones(truths.state.shape, bool), weights)
    for name in MEASURES:
        measure = summary.measures[name]
        assert scores[name] == measure.estimate
        assert scores[f"{name}_ci"] == [measure.low, measure.high]
        assert scores[f"{name}_by_seed"] == [measure.estimate]
        assert scores[f"{name}_sd"] is None
    assert scores["n_joints"] == scores["occluded"]["n_joints"] + scores["non_occluded"]["n_joints"]


def test_scores_of_seeds_are_their_mean_and_spread():
    truths = truths_of()
    seeds = [results_of(truths, seed=seed, error=0.04 * seed) for seed in (1, 2, 3)]
    weights = draw_frames(len(truths), 40, np.random.default_rng(0))
    together = row_scores(seeds, weights)
    alone = [row_scores([results], weights) for results in seeds]
    for group in ("", *GROUPS):
        of_all, of_each = (together[group], [a[group] for a in alone]) if group else (together, alone)
        values = [scores["map_10cm"] for scores in of_each]
        assert of_all["map_10cm"] == pytest.approx(np.mean(values))
        assert of_all["map_10cm_by_seed"] == values
        assert of_all["map_10cm_sd"] == pytest.approx(np.std(values, ddof=1))
        low, high = of_all["map_10cm_ci"]
        assert low <= of_all["map_10cm"] <= high


def test_differences_are_of_pairs_that_are_there_and_of_means_over_seeds():
    truths = truths_of()
    good, bad = ([results_of(truths, seed=s, error=error) for s in (1, 2)] for error in (0.02, 0.2))
    documents = pair_scores({"semantic": good, "occluders": bad, "rwf": good[:1]}, Resampling(99))
    assert list(documents) == ["semantic - occluders", "semantic - rwf"]
    gap = documents["semantic - occluders"]["map_10cm"]
    weights = draw_frames(len(truths), 5, np.random.default_rng(0))
    means = [row_scores(seeds, weights)["accuracy_10cm"] for seeds in (good, bad)]
    assert documents["semantic - occluders"]["accuracy_10cm"]["estimate"] == pytest.approx(means[0] - means[1])
    assert 0 < gap["ci"][0] <= gap["estimate"] <= gap["ci"][1]
    assert gap["p_value"] == pytest.approx(0.01)
    same = documents["semantic - rwf"]
    assert (same["n_seeds"], same["map_10cm"]["estimate"], same["map_10cm"]["p_value"]) == (1, 0.0, 1.0)


def test_one_training_compares_as_the_metrics_do():
    truths = truths_of()
    first, second = (results_of(truths, seed=s, error=error) for s, error in ((1, 0.05), (2, 0.1)))
    ours = pair_scores({"semantic": [first], "baseline": [second]}, Resampling(30))["semantic - baseline"]
    theirs = compare(first, second, np.ones(truths.state.shape, bool), np.random.default_rng(0), 30)
    for name in MEASURES:
        assert ours[name]["estimate"] == pytest.approx(theirs[name].estimate)
        assert ours[name]["p_value"] == theirs[name].p_value


# Detectors


def test_only_methods_that_start_in_a_box_are_told_one(toy_corpus):
    frames = CorpusFrames(toy_corpus, toy_corpus.split("test")[:2])
    truths = read_truths(toy_corpus, frames.indices)
    told = []

    class Listener:
        def predict(self, depth, camera, box=None):
            told.append(box)
            n = len(JOINT_NAMES)
            unknown = np.zeros(n, np.float32)
            nothing = np.full((n, 1, 3), np.nan, np.float32)
            return JointEstimate(nothing, np.zeros((n, 1), np.float32), unknown, unknown, unknown, camera)

    predict_frames(Contestant("forest", Listener(), JOINT_NAMES), frames, truths)
    assert not any(told)
    told.clear()
    predict_frames(Contestant("walk", Listener(), JOINT_NAMES, box_joints=("head", "neck")), frames, truths)
    left, top, right, bottom = told[-1]
    uv = frames[1].camera.project(frames[1].joints[:2])
    assert ((left, top) < uv).all()
    assert (uv < (right, bottom)).all()


# A run


QUESTIONS = ("--questions", "trees", "pixels", "imported")


def write_settings(folder):
    """A TOML file of settings, and the libraries that it names."""
    library.write_library(folder / "poses.lib", poses_of("test"))
    meshlib.write_library(folder / "objects.lib", objects_of("test"))
    toml = folder / "tiny.toml"
    paths = {f"test_{name}": folder / f"{name}.lib" for name in ("poses", "objects")}
    toml.write_text("".join(f'{name} = "{path}"\n' for name, path in paths.items()) + TINY)
    return toml


def run(out, capsys, *options, size="demo"):
    toml = write_settings(out.parent)
    code = main(["ablate", "--size", size, "--config", str(toml), "--out", str(out), *options])
    return code, capsys.readouterr()


def document_of(out):
    """ablation.json without times, and without the digests of what holds none."""

    def timeless(value):
        if isinstance(value, dict):
            return {name: timeless(item) for name, item in value.items() if not name.startswith("seconds")}
        return [timeless(item) for item in value] if isinstance(value, list) else value

    return timeless(json.loads((out / "ablation.json").read_text()))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """An ablation that ran undisturbed with two threads."""
    out = tmp_path_factory.mktemp("ablation") / "a"
    toml = write_settings(out.parent)
    words = ["ablate", "--size", "demo", "--config", str(toml), "--out", str(out), "--threads", "2"]
    assert main([*words, *QUESTIONS]) == 0
    return out


def test_a_run_tells_every_row_group_and_measure(finished):
    document = document_of(finished)
    assert list(document["main"]["rows"]) == ["baseline", "occluders", "semantic", "rwf"]
    for row in document["main"]["rows"].values():
        assert row["n_frames"] == 6
        assert len(row["trainings"]) == row["n_seeds"] == len(row["pixels"])
        for scores in (row, *(row[group] for group in GROUPS)):
            assert all({name, f"{name}_ci", f"{name}_by_seed", f"{name}_sd"} <= scores.keys() for name in MEASURES)
    assert list(document["main"]["differences"]) == [
        "semantic - occluders", "occluders - baseline", "semantic - baseline",
    ]  # fmt: skip
    assert document["settings"]["corpus"]["seed"] == 3
    assert document["corpora"][0]["n_frames"] == {"train": 10, "val": 3, "test": 6}
    assert [item["settings"] for item in document["questions"]["trees"]] == [{"n_trees": 1}, {"n_trees": 2}]
    assert (
        document["questions"]["pixels"][1]["rows"]["semantic"]["map_10cm"]
        == (document["main"]["rows"]["semantic"]["map_10cm_by_seed"][0])
    )


def test_the_document_names_files_that_are_there_and_fit(finished):
    document = document_of(finished)
    corpus = Corpus.open(finished / document["corpora"][0]["folder"])
    for name, row in document["main"]["rows"].items():
        for training in row["trainings"]:
            assert (finished / training["model"]["file"]).is_file()
            (results,), context = read_results(finished / training["rows"]["file"])
            assert results.method == context["row"] == name
            assert context["seed"] == training["seed"]
            assert context["corpus"]["digest"] == corpus.digest
            assert (results.truths.frame == corpus.split("test")).all()


def test_json_is_one_object_that_equals_the_file(finished, capsys):
    words = ["ablate", "--size", "demo", "--config", str(finished.with_name("tiny.toml")), "--out", str(finished)]
    assert main([*words, *QUESTIONS, "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert json.loads(out) == json.loads((finished / "ablation.json").read_text())


def test_the_table_stands_beside_the_papers(finished, capsys):
    code, captured = run(finished, capsys, *QUESTIONS)
    lines = captured.out.splitlines()
    assert code == 0
    for row, paper in (("baseline", "44"), ("occluders", "48"), ("semantic", "54")):
        assert next(line for line in lines if line.startswith(row)).split()[-1] == paper
    assert any(line.startswith("semantic - occluders") for line in lines)
    assert "question: trees" in lines


class Killed(BaseException):
    """What no code catches."""


def killed_at(patch, owner, name, n_before, seen=None):
    """Lets a function work so many times, then ends the run; keeps its arguments in `seen`."""
    work, n_left = getattr(owner, name), [n_before]

    def do(*args, **kwargs):
        n_left[0] -= 1
        if n_left[0] < 0:
            raise Killed
        if seen is not None:
            seen.append((args[0].path, *args[1:2]))
        return work(*args, **kwargs)

    patch.setattr(owner, name, do)


def test_a_killed_run_goes_on_to_the_same_document(finished, tmp_path, capsys, monkeypatch):
    out, saved = tmp_path / "a", []
    killed_at(monkeypatch, TreeFolder, "save", 10**6, saved)
    kept: dict = {}
    for owner, name, n_before in (
        (ablate_run, "write_corpus", 2),
        (TreeFolder, "save", 3),
        (ablate_run, "train_model", 2),
        (ablate_run, "write_results", 3),
    ):
        with monkeypatch.context() as patch:
            killed_at(patch, owner, name, n_before)
            with pytest.raises(Killed):
                run(out, capsys, *QUESTIONS, "--threads", "1")
        assert not (out / "ablation.json").exists()
        files = [
            path
            for path in out.rglob("*.*")
            if path.parent.name in ("models", "rows", "frames") and path.is_file()
        ]
        now = {path: path.stat().st_mtime_ns for path in files}
        assert kept.items() <= now.items()
        assert len(now) > len(kept)
        kept = now
    assert run(out, capsys, *QUESTIONS, "--threads", "1")[0] == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert len(set(saved)) == len(saved) >= 12
    assert not list(out.rglob("*.partial"))
    assert document_of(out) == document_of(finished)


def test_a_finished_run_makes_nothing_again(finished, capsys, monkeypatch):
    for step in ("write_corpus", "train_model", "write_results"):
        monkeypatch.delattr(ablate_run, step)
    assert run(finished, capsys, *QUESTIONS)[0] == 0


def test_imported_frames_are_scored_by_the_main_tables_forests(finished):
    document = document_of(finished)
    main_rows = document["main"]["rows"]
    digests = {"poses": poses_of("test").digest, "objects": objects_of("test").digest}
    assert {name: document["settings"][f"test_{name}"] for name in digests} == digests
    folders = {item["folder"]: item for item in document["corpora"]}
    for condition in document["questions"]["imported"]:
        taken = {name: condition["settings"][name] != "procedural" for name in digests}
        assert (condition["rows"] == main_rows) == (not any(taken.values()))
        for name, row in condition["rows"].items():
            for ours, theirs in zip(row["trainings"], main_rows[name]["trainings"], strict=True):
                assert ours["model"] == theirs["model"]
            told = folders[ours["rows"]["corpus"]]
            assert told["imported"] == {key: digests[key] if taken[key] else None for key in digests}
            corpus = Corpus.open(finished / told["folder"])
            (results,), context = read_results(finished / ours["rows"]["file"])
            assert context["corpus"] == {"folder": told["folder"], "digest": corpus.digest}
            assert (results.truths.frame == corpus.split("test")).all()
        infos = [corpus.info(int(i)) for i in corpus.split("test")]
        assert all(info.pose_id.startswith("mocap/test/") == taken["poses"] for info in infos)
        tables = {part.spec_id for info in infos for part in info.objects if part.class_name == "table"}
        assert all(table.startswith("imported/") == taken["objects"] for table in tables)


def test_selections_keep_a_class_out_and_as_many_frames_in(finished):
    config = load_config("demo", finished.with_name("tiny.toml"))
    folder = ResultsFolder(finished)
    corpus = folder.open_corpus(make_plan(config).corpora[0])
    for name in ("table", "laptop"):
        of = {
            rule: Selection("train", 10, rule, name).of(corpus)
            for rule in ("all", "without", "showing", "as_many")
        }
        shown = {i for i in of["all"] if name in {item.class_name for item in corpus.info(int(i)).objects}}
        assert set(of["showing"]) <= shown
        assert set(of["showing"]) | set(of["without"]) == set(of["all"])
        assert set(of["showing"]).isdisjoint(of["without"])
        assert len(of["as_many"]) == len(set(of["as_many"])) == len(of["without"])
    assert (Selection("train", 4).of(corpus) == corpus.split("train")[:4]).all()


# The demo


def test_the_demo_ends_with_the_table_and_the_report(tmp_path, capsys):
    toml = tmp_path / "tiny.toml"
    toml.write_text(TINY.replace("oarf = 2", "oarf = 1"))
    out = tmp_path / "demo"
    assert main(["demo", "--out", str(out), "--config", str(toml)]) == 0
    lines = capsys.readouterr().out.strip().splitlines()
    assert lines[-1] == f"report: {out / 'report.html'}"
    assert any(line.startswith("semantic ") for line in lines)
    assert (out / "report.html").read_text().startswith("<!doctype html>")
    assert (out / "inspect" / "sheet_00.png").exists()
