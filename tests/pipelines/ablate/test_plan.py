"""The plan of an ablation, what its keys depend on, and its settings."""

from dataclasses import asdict, replace
from pathlib import Path

import pytest
from toy_libraries import objects_of, poses_of

from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.rwf.config import RWFConfig
from pipelines.ablate.config import FOREST_ROWS, AblationConfig, CorpusConfig, load_config, merged
from pipelines.ablate.libraries import Libraries, Library
from pipelines.ablate.plan import QUESTIONS, make_plan
from pipelines.cli import main
from synth.bodies.poses import library
from synth.occluders import meshlib
from synth.scene import SceneConfig

CONFIG = AblationConfig(questions=tuple(QUESTIONS), n_seeds={"oarf": 2, "rwf": 1})
LIBRARIES = Libraries(Library(Path("poses.lib"), "p"), Library(Path("objects.lib"), "o"))


# The plan


def keys_of(config):
    """Keys of corpora, of models by row and seed, and of rows by row and seed, of the main table."""
    main = make_plan(config).conditions[0]
    trainings = {(job.training.row, job.training.config.seed): job.training for job in main.scorings}
    return {
        "corpus": {job.training.corpus.key for job in main.scorings},
        "oarf": {name: job.key for name, job in trainings.items() if not name[0].startswith("rwf")},
        "rwf": {name: job.key for name, job in trainings.items() if name[0].startswith("rwf")},
        "rows": {(job.training.row, job.training.config.seed): job.key for job in main.scorings},
    }


def with_models(**models):
    return replace(CONFIG, models={**CONFIG.models, **models})


def with_corpus(**changes):
    return replace(CONFIG, corpus=replace(CONFIG.corpus, **changes))


@pytest.mark.parametrize(
    ("changed", "what_changes"),
    [
        (replace(CONFIG, n_resamples=10), set()),
        (replace(CONFIG, questions=()), set()),
        (replace(CONFIG, unseen_class="table", noisy_sensor="kinect_v1", tree_counts=(2,)), set()),
        (with_models(oarf=OARFConfig(mode="baseline", learn_skeleton=False)), set()),
        (with_models(rwf=RWFConfig(layer="body", learn_skeleton=False)), set()),
        (replace(CONFIG, sensor="kinect_v2"), {"oarf", "rwf", "rows"}),
        (with_models(oarf=OARFConfig(n_pixels=999)), {"oarf", "rows"}),
        (with_models(oarf=OARFConfig(growth=GrowthConfig(max_depth=19))), {"oarf", "rows"}),
        (with_models(rwf=RWFConfig(n_points=299)), {"rwf", "rows"}),
        (with_corpus(test_frames=439), {"corpus", "rows"}),
        (with_corpus(val_frames=199), {"corpus", "oarf", "rwf", "rows"}),
        (with_corpus(train_frames=1111), {"corpus", "oarf", "rwf", "rows"}),
        (with_corpus(seed=1), {"corpus", "oarf", "rwf", "rows"}),
        (with_corpus(scene=SceneConfig(is_context_kept=False)), {"corpus", "oarf", "rwf", "rows"}),
        (with_corpus(scene=SceneConfig(child_share=0.2)), {"corpus", "oarf", "rwf", "rows"}),
    ],
)
def test_a_key_changes_exactly_when_something_that_it_depends_on_does(changed, what_changes):
    before, after = keys_of(CONFIG), keys_of(changed)
    assert {name for name in before if before[name] != after[name]} == what_changes


def test_other_software_changes_every_key(monkeypatch):
    before = keys_of(CONFIG)
    monkeypatch.setattr("pipelines.ablate.jobs.versions", lambda: {"numpy": "99"})
    after = keys_of(CONFIG)
    assert all(before[name] != after[name] for name in before)


@pytest.mark.parametrize(
    ("place", "what_changes"),
    [
        ("synth", {"corpus", "oarf", "rwf", "rows"}),
        ("forests", {"oarf", "rwf", "rows"}),
        ("pipelines/metrics", {"rows"}),
    ],
)
def test_other_sources_change_the_keys_of_what_they_make(monkeypatch, place, what_changes):
    def keys(edited):
        monkeypatch.setattr("pipelines.ablate.jobs.sources_digest", lambda *places: str(edited in places))
        return keys_of(CONFIG)

    before, after = keys(""), keys(place)
    assert {name for name in before if before[name] != after[name]} == what_changes


def test_every_method_of_a_seed_has_the_same_frames_and_its_own_model():
    main = make_plan(CONFIG).conditions[0]
    assert main.rows == FOREST_ROWS
    assert [len(main.of_row(row)) for row in FOREST_ROWS] == [2, 2, 2, 1, 1]
    assert len({job.training.key for job in main.scorings}) == len(main.scorings) == 8
    for name in ("corpus", "train", "val", "sensor"):
        assert len({getattr(job.training, name) for job in main.scorings}) == 1
    assert len({job.test for job in main.scorings}) == 1
    assert [job.training.config.seed for job in main.of_row("semantic")] == [0, 1]
    layers = {row: main.of_row(row)[0].training.config.layer for row in ("rwf_body", "rwf")}
    assert layers == {"rwf_body": "body", "rwf": "composite"}


def test_rows_of_nets_differ_in_what_they_see_and_name():
    config = replace(CONFIG, rows=("heat_body", "heat", "heat_object", "heat_classes"))
    main = make_plan(replace(config, questions=())).conditions[0]
    told = {job.training.row: (job.training.config.layer, job.training.config.naming) for job in main.scorings}
    assert told == {
        "heat_body": ("body", "none"),
        "heat": ("composite", "none"),
        "heat_object": ("composite", "one_class"),
        "heat_classes": ("composite", "each_class"),
    }
    assert len({job.training.key for job in main.scorings}) == 4
    for condition in make_plan(replace(config, questions=("skeletons",))).conditions[1:]:
        assert condition.rows == (), "nets make no skeleton of their proposals"


@pytest.mark.parametrize(("row", "is_changed"), [("heat", True), ("rwf", False)])
def test_models_that_are_nets_depend_on_the_nets_sources_and_on_torch(monkeypatch, row, is_changed):
    def key(sources, version):
        monkeypatch.setattr("pipelines.ablate.jobs.sources_digest", lambda *places: str(sources in places))
        monkeypatch.setattr("pipelines.ablate.jobs.version_of", lambda package: version)
        plan = make_plan(replace(CONFIG, rows=(row,), questions=()))
        return plan.conditions[0].scorings[0].training.key

    assert (key("", "1") != key("nets", "1")) is is_changed
    assert (key("", "1") != key("", "2")) is is_changed


SCENES = ("unhidden", "table", "laptop_table", "laptop_lap", "stroller", "clutter", "several")
VARIED = {
    "context": {"training.corpus.config.scene.is_context_kept", "corpus.config.scene.is_context_kept"},
    "paper_scenes": {
        f"{place}corpus.config.scene.scenes.{name}" for place in ("training.", "") for name in SCENES
    },
    "unseen_class": {"training.train.rule"},
    "sensor": {"training.sensor", "sensor"},
    "imported": {"corpus.imported.poses", "corpus.imported.objects"},
    "skeletons": {"training.config.learn_skeleton"},
    "oracles": {"training.told"},
    "frames": {"training.train.n"},
    "trees": {"n_trees"},
    "pixels": {"n_pixels"},
    "rooms": {"training.place", "place"},
}


def leaves(values, prefix=""):
    for name, value in values.items():
        yield from leaves(value, f"{prefix}{name}.") if isinstance(value, dict) else [(prefix + name, value)]


@pytest.mark.parametrize("question", QUESTIONS)
def test_conditions_of_a_question_differ_in_what_it_asks_alone(question):
    conditions = [item for item in make_plan(CONFIG, LIBRARIES).conditions if item.question == question]
    first = conditions[0]
    assert len(conditions) > 1
    differing = set()
    for condition in conditions:
        assert condition.rows == first.rows
        for job, reference in zip(condition.scorings, first.scorings, strict=True):
            ours, theirs = dict(leaves(asdict(job))), dict(leaves(asdict(reference)))
            names = {name.removesuffix(".path").removesuffix(".digest") for name in ours.keys() ^ theirs.keys()}
            differing |= names | {name for name in ours.keys() & theirs.keys() if ours[name] != theirs[name]}
    assert differing == VARIED[question]
    assert len({condition.settings for condition in conditions}) == len(conditions)


@pytest.mark.parametrize("question", sorted(set(QUESTIONS) - {"unseen_class", "rooms"}))
def test_a_question_uses_work_of_the_main_table_again(question):
    main, *conditions = make_plan(replace(CONFIG, questions=(question,)), LIBRARIES).conditions
    known = {job.key for job in main.scorings}
    is_known = [{job.key for job in condition.scorings} <= known for condition in conditions]
    assert is_known.count(True) == 1


def test_oracles_are_compared_with_a_forest_that_is_told_nothing_and_names_with_a_mask():
    _, *conditions = make_plan(replace(CONFIG, questions=("oracles",))).conditions
    by_truth = {condition.settings[0][1]: condition for condition in conditions}
    compared = {truth: [name for name, _ in condition.compared] for truth, condition in by_truth.items()}
    assert compared["nothing"] == []
    assert compared["classes"] == ["told nothing", "told mask"]
    assert all(
        names == ["told nothing"] for truth, names in compared.items() if truth not in ("nothing", "classes")
    )
    for condition in conditions:
        for name, scorings in condition.compared:
            assert scorings == by_truth[name.removeprefix("told ")].scorings


def test_people_in_rooms_are_learned_as_they_are_asked_and_compared_with_those_who_are_cut_out():
    _, *conditions = make_plan(replace(CONFIG, questions=("rooms",))).conditions
    settings = [tuple(value for _, value in condition.settings) for condition in conditions]
    assert settings == [("cut out", "true"), ("in the room", "true"), ("in the room", "found")]
    cut, true, found = conditions
    assert [job.training.key for job in true.scorings] == [job.training.key for job in found.scorings]
    assert not {job.training.key for job in true.scorings} & {job.training.key for job in cut.scorings}
    assert cut.compared == ()
    assert true.compared == found.compared == (("cut out", cut.scorings),)
    assert all(job.corpus.scene.room.kinds.hall for job in cut.scorings)
    assert all(job.sensor == job.training.sensor == CONFIG.noisy_sensor for job in found.scorings)


def test_chosen_oracles_are_asked_in_the_order_in_which_they_are_compared():
    config = replace(CONFIG, questions=("oracles",), oracles=("classes", "mask"))
    _, *conditions = make_plan(config).conditions
    assert [condition.settings[0][1] for condition in conditions] == ["nothing", "mask", "classes"]
    assert [name for name, _ in conditions[-1].compared] == ["told nothing", "told mask"]
    with pytest.raises(ValueError, match="'age' is unknown; known are mask"):
        replace(CONFIG, oracles=("age",))


def test_trees_and_pixels_need_no_training():
    n_main = len(make_plan(replace(CONFIG, questions=())).trainings)
    assert len(make_plan(replace(CONFIG, questions=("trees", "pixels"))).trainings) == n_main


def imported_corpora(libraries):
    """Corpora of the test frames by (poses, objects), and whether the question needs trainings of its own."""
    plan = make_plan(replace(CONFIG, questions=("imported",)), libraries)
    main, *conditions = plan.conditions
    assert plan.trainings == make_plan(replace(CONFIG, questions=())).trainings
    for condition in conditions:
        assert [job.training.key for job in condition.scorings] == [job.training.key for job in main.scorings]
    return {tuple(dict(item.settings).values()): item.scorings[0].corpus for item in conditions}


def test_the_question_imported_tests_the_main_tables_forests_on_what_is_given():
    both = imported_corpora(LIBRARIES)
    assert list(both) == [
        ("procedural", "procedural"), ("recorded", "procedural"),
        ("procedural", "imported"), ("recorded", "imported"),
    ]  # fmt: skip
    assert [corpus.counts for corpus in both.values()] == [(1110, 200, 440), *[(0, 0, 440)] * 3]
    assert len({corpus.key for corpus in both.values()}) == 4
    assert list(imported_corpora(replace(LIBRARIES, objects=None))) == list(both)[:2]
    assert list(imported_corpora(replace(LIBRARIES, poses=None))) == list(both)[::2]


def test_a_librarys_digest_is_in_the_keys_and_its_path_is_not():
    def keys(**poses):
        libraries = replace(LIBRARIES, poses=replace(LIBRARIES.poses, **poses))
        plan = make_plan(replace(CONFIG, questions=("imported",)), libraries)
        by_condition = [
            {job.key for job in item.scorings} | {item.scorings[0].corpus.key} for item in plan.conditions
        ]
        return by_condition[1:]

    assert keys(path=Path("moved")) == keys()
    are_same = [ours == theirs for ours, theirs in zip(keys(digest="q"), keys(), strict=True)]
    assert are_same == [True, False, True, False]


# Settings


@pytest.mark.parametrize(
    ("size", "n_train", "n_test"), [("demo", 250, 100), ("paper", 1110, 440), ("large", 10000, 1000)]
)
def test_the_sizes_are_shipped(size, n_train, n_test):
    config = load_config(size)
    assert (config.corpus.train_frames, config.corpus.test_frames) == (n_train, n_test)
    assert replace(config, questions=tuple(QUESTIONS)).questions == tuple(QUESTIONS)


def test_the_papers_size_has_the_papers_forests():
    config = load_config("paper")
    assert (config.models["oarf"], config.corpus, config.rows) == (
        OARFConfig(learn_skeleton=False),
        CorpusConfig(),
        FOREST_ROWS,
    )


def test_a_file_goes_before_the_size(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("n_seeds = { oarf = 3 }\n[corpus]\nseed = 5\n")
    config, demo = load_config("demo", path), load_config("demo")
    assert config == replace(
        demo, n_seeds={"oarf": 3, "rwf": 1, "heatmap": 1}, corpus=replace(demo.corpus, seed=5)
    )
    assert merged({"a": {"b": 1, "c": 2}}, {"a": {"b": 3}, "d": 4}) == {"a": {"b": 3, "c": 2}, "d": 4}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("row = ['rwf']", "unknown key 'row'; known are corpus, rows"),
        ("rows = ['rwf', 'kinect']", "rows: 'kinect' is unknown; known are baseline"),
        ("rows = ['rwf', 'rwf']", "must hold at least 1 names, all different"),
        ("n_seeds = { oarf = 0 }", "n_seeds.oarf=0 must be in"),
        ("n_seeds = { cnn = 1 }", "n_seeds: 'cnn' is unknown; known are oarf, rwf, heatmap"),
        ("oarf = 3", ".oarf=3 must be a table"),
        ("n_question_seeds = 2", "n_question_seeds=2 must be in 1..1"),
        ("unseen_class = 'bathtub'", "unseen_class: 'bathtub' is unknown; known are table"),
        ("sensor = 'eye'", "sensor: 'eye' is unknown; known are ideal"),
        ("questions = ['frames']\nframe_counts = [251]", "frame_counts=251 must be in 1..250"),
        ("[corpus]\ntest_frames = 0", "test_frames=0 must be in"),
        ("[oarf]\nn_trees = 0", "n_trees=0 must be in"),
    ],
)
def test_wrong_settings_are_one_line_and_touch_nothing(tmp_path, capsys, text, message):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    assert main(["ablate", "--size", "demo", "--config", str(path), "--out", str(tmp_path / "a")]) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "a").exists()


def test_a_question_that_does_not_fit_is_one_line(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text("tree_counts = [1, 99]")
    words = ["ablate", "--size", "demo", "--config", str(path), "--out", str(tmp_path / "a")]
    assert main([*words, "--questions", "trees"]) == 1
    assert capsys.readouterr().err == "undergrowth: error: tree_counts=99 must be in 1..2\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--questions", "imported"], "question imported needs a library to test on: give --poses or --objects"),
        (["--poses", "POSES"], "POSES is used only by the question imported; ask that question too"),
        (["--objects", "OBJECTS"], "OBJECTS is used only by the question imported; ask that question too"),
        (["--questions", "imported", "--poses", "none"], "there is no pose library none"),
        (["--questions", "imported", "--objects", "none"], "there is no object library none"),
        (["--questions", "imported", "--poses", "OBJECTS"], "OBJECTS is no"),
        (["--questions", "imported", "--objects", "CUT"], "CUT is damaged or truncated"),
        (
            ["--questions", "imported", "--poses", "POSES"],
            "POSES has no poses in the split test; import some with --test",
        ),
        (["--questions", "imported", "--objects", "OBJECTS"], "OBJECTS has no objects in the split test"),
    ],
)
def test_libraries_that_cannot_be_tested_on_are_one_line(tmp_path, capsys, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    library.write_library(Path("POSES"), poses_of("train"))
    meshlib.write_library(Path("OBJECTS"), objects_of("train"))
    Path("CUT").write_bytes(Path("OBJECTS").read_bytes()[:-100])
    assert main(["ablate", "--size", "demo", "--out", "a", *words]) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not Path("a").exists()
