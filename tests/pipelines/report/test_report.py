"""The report of made-up answers: sound HTML that needs nothing else, the metrics' numbers, examples by rule."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from jinja2 import UndefinedError
from toy_results import results_of

from pipelines.ablate.config import AblationConfig
from pipelines.ablate.schema import PAPER_MAP_10CM
from pipelines.ablate.table import Resampling, pair_scores, row_scores
from pipelines.cli import main
from pipelines.corpus.header import software_versions
from pipelines.drawing.html import Image
from pipelines.metrics import (
    MEASURES,
    by_hiding_class,
    by_joint,
    by_state,
    compare,
    draw_frames,
    errors,
    read_truths,
    summarise,
)
from pipelines.metrics.document import pixel_values
from pipelines.metrics.pixels import Confusion
from pipelines.metrics.results import write_results
from pipelines.models.asking import Contestant
from pipelines.models.kinds import KINDS
from pipelines.models.opening import file_digest
from pipelines.report.chart import Axis, Point, Series, line_chart, round_axis
from pipelines.report.examples import PLACES, Place, at_quantiles
from pipelines.report.methods import METHODS, kinds_of, shown_methods
from pipelines.report.page import Section, Table, Tile, rendered
from pipelines.report.pictures import TILE_WIDTH
from pipelines.report.source import read_source
from pipelines.report.text import MINUS, NOTHING, SPACE, UNITS, number, p_value, with_interval
from pipelines.report.write import report_page
from synth.vocabulary import JointState

N_RESAMPLES = 40
ERRORS_M = {"baseline": 0.11, "occluders": 0.08, "semantic": 0.06, "rwf_body": 0.1, "rwf": 0.09}
GROUPS = {"": "all", "non_occluded": "non_occluded", "occluded": "occluded"}
SEMANTICS = f"with semantics {MINUS} without semantics"
VOID = {"meta", "img", "br", "hr", "link", "input"}


# Made-up ablations


def answers_of(truths, rows=tuple(ERRORS_M), n_seeds=1):
    made = {}
    for k, row in enumerate(rows):
        seeds = [results_of(truths, ERRORS_M[row], seed=10 * k + s, method=row) for s in range(n_seeds)]
        made[row] = seeds
    return made


def write_folder(path, corpus, answers, questions=None, models=()):
    """An ablation's folder of answers; as `undergrowth ablate` writes it, without forests."""
    (path / "rows").mkdir(parents=True)
    (path / "models").mkdir()
    confusion = Confusion(
        np.full((38, 31), 2), tuple(f"l{k}" for k in range(38)), tuple(f"c{k}" for k in range(31)), 31
    )
    resampling = Resampling(N_RESAMPLES)
    rows = {}
    for row, seeds in answers.items():
        trainings = []
        for seed, results in enumerate(seeds):
            file, model = f"rows/{row}-{seed}.npz", path / f"models/{row}-{seed}.safetensors"
            write_results(path / file, [results], {"key": f"key of {row} {seed}"})
            model.write_bytes(b"forest")
            told = {"file": f"models/{model.name}", "key": "k", "digest": file_digest(model)}
            if row not in models:
                model.unlink()
            trainings.append(
                {"seed": seed, "corpus": "corpus-0", "n_train_frames": 140, "model": told,
                 "rows": {"file": file, "key": f"key of {row} {seed}"}}
            )  # fmt: skip
        weights = draw_frames(len(seeds[0].truths), resampling.n, resampling.rng())
        pixels = [None if row.startswith("rwf") else pixel_values(confusion) for _ in seeds]
        rows[row] = row_scores(seeds, weights)
        rows[row] |= {"pixels": pixels, "seconds_per_frame": 0.001, "trainings": trainings}
    document = {
        "schema": "undergrowth ablation", "schema_version": 1,
        "settings": AblationConfig(n_resamples=N_RESAMPLES).plain(),
        "software": software_versions(), "sources": {"synth": "abc"},
        "corpora": [{"folder": "corpus-0", "key": "k", "digest": corpus.digest, "is_context_kept": True,
                     "n_frames": {"train": 140, "val": 30, "test": 30}}],
        "paper_map_10cm": dict(PAPER_MAP_10CM),
        "main": {"settings": {}, "rows": rows, "differences": pair_scores(answers, resampling)},
        "questions": questions or {}, "seconds_of_last_run": 1.0,
    }  # fmt: skip
    (path / "ablation.json").write_text(json.dumps(document, allow_nan=False))
    return path


@pytest.fixture(scope="module")
def truths(toy_corpus):
    return read_truths(toy_corpus, toy_corpus.split("test"))


@pytest.fixture(scope="module")
def answers(truths):
    return answers_of(truths)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, toy_corpus, answers):
    return write_folder(tmp_path_factory.mktemp("report") / "a", toy_corpus, answers)


@pytest.fixture(scope="module")
def page(folder, toy_corpus):
    return report_page(read_source(folder, toy_corpus.path))


@pytest.fixture(scope="module")
def parsed(page):
    return Page(page)


def page_of(tmp_path, corpus, answers, with_corpus=True, **parts):
    made = write_folder(tmp_path / "a", corpus, answers, **parts)
    return report_page(read_source(made, corpus.path if with_corpus else None))


# Reading pages


class Page(HTMLParser):
    """A page's tables by id, its links and pictures; refuses tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tables, self.ids, self.sources, self.links, self.tags = [], {}, [], [], [], set()
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        assert len(attributes) == len({name for name, _ in attributes})
        given = dict(attributes)
        self.tags.add(tag)
        self.ids += [given["id"]] if "id" in given else []
        self.sources += [given["src"]] if "src" in given else []
        self.links += [given["href"]] if "href" in given else []
        if tag == "table":
            self.rows = self.tables[given["id"]] = []
        elif tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert tag not in VOID
        assert self.open.pop() == tag, self.getpos()

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data

    def cells(self, name):
        """The body of a table: cells by the row's name."""
        return {row[0]: row[1:] for row in self.tables[name][1:]}


def numbers(cell):
    """The numbers of a cell as they are shown."""
    return [float(word.replace(MINUS, "-")) for word in re.findall(rf"[+{MINUS}]?\d+\.?\d*", cell)]


def shown(*values):
    """Values as the page rounds them."""
    return pytest.approx([round(100 * v, 1) for v in values], abs=0.051)


# The file


def test_the_page_is_well_formed(parsed):
    assert {"html", "head", "body", "main", "section", "table", "svg", "img"} <= parsed.tags
    assert len(parsed.ids) == len(set(parsed.ids))
    assert parsed.links
    assert all(link.startswith("#") and link[1:] in parsed.ids for link in parsed.links)


def test_the_page_needs_nothing_else(page, parsed):
    assert parsed.sources
    assert all(source.startswith("data:image/") for source in parsed.sources)
    for word in ("http", "<link", "<script", "url(", "@import", "srcset"):
        assert word not in page


def test_the_page_is_small(page):
    assert len(page.encode()) < 8_000_000


def test_pictures_are_as_wide_as_said(page):
    assert set(re.findall(r'<img [^>]*?width="(\d+)"', page)) == {str(TILE_WIDTH)}


def test_the_same_folder_gives_the_same_bytes(folder, toy_corpus, page, tmp_path, capsys):
    out = tmp_path / "r.html"
    assert main(["report", str(folder), "--out", str(out), "--corpus", str(toy_corpus.path)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert out.read_text(encoding="utf-8") == page


def test_words_are_escaped():
    table = Table("t", '"<b>', ["", "a & b"], [["<i>", "&amp;"]])
    page = Page(rendered("pixels", labels=table))
    assert page.tables["t"] == [["", "a & b"], ["<i>", "&amp;"]]
    assert not page.tags & {"b", "i"}


def test_words_beside_pictures_are_escaped():
    word = '"><script>&'
    tiles = [Tile(word, [Image(word, 1, 1, "data:image/png;base64,")])]
    folder = {"name": word, "layout": word, "n_asked": 1, "n_frames": 1, "is_spread": False, "skipped": (word,),
              "scores": None, "examples": [(word, tiles)]}  # fmt: skip
    text = Section("recorded", "t", {"folders": [folder]}).body
    assert "<script" not in text
    assert text.count("script&gt;&amp;") == 6
    assert "img" in Page(text).tags


def test_a_template_refuses_what_it_is_not_given():
    with pytest.raises(UndefinedError, match="least_frames"):
        rendered("joints", charts=[], methods=[])


# Numbers


@pytest.mark.parametrize("row", ERRORS_M)
def test_tables_show_the_metrics_with_their_intervals(parsed, answers, truths, row):
    weights = draw_frames(len(truths), N_RESAMPLES, np.random.default_rng(0))
    name = METHODS[row].name
    states = by_state(truths)
    for k, (group, words) in enumerate(GROUPS.items()):
        mask = states[group] if group else np.ones(truths.state.shape, bool)
        summary = summarise(answers[row][0], mask, weights)
        assert numbers(parsed.cells("precision")[name][1 + k]) == shown(*of(summary, "map_10cm"))
        assert numbers(parsed.cells("detection-here")[name][2 - k]) == shown(*of(summary, "accuracy_2d"))
        cells = parsed.cells(f"measures-{words}")[name]
        measures = [m for m in MEASURES if m not in ("map_10cm", "accuracy_2d")]
        for measure, cell in zip(measures, cells, strict=True):
            values = [value * UNITS[measure] / 100 for value in of(summary, measure)]
            assert numbers(cell) == shown(*values)


def of(summary, measure):
    found = summary.measures[measure]
    return found.estimate, found.low, found.high


def test_the_papers_figures_stand_beside(parsed):
    precision = parsed.cells("precision")
    assert [precision[METHODS[row].name][0] for row in ERRORS_M] == ["44.0", "48.0", "54.0", NOTHING, NOTHING]
    assert parsed.cells("detection-both")["OARF with semantics"] == ["35.77", "56.01", "51.72"]
    assert parsed.cells("detection-synthetic")["Baseline"] == ["22.17", "50.51", "44.54"]


def test_differences_are_those_of_the_paired_test(parsed, answers, truths):
    first, second = answers["semantic"][0], answers["occluders"][0]
    cells = parsed.cells("precision-differences")[SEMANTICS]
    states = by_state(truths)
    for cell, group in zip(cells, GROUPS, strict=True):
        mask = states[group] if group else np.ones(truths.state.shape, bool)
        gap = compare(first, second, mask, np.random.default_rng(0), N_RESAMPLES)["map_10cm"]
        *values, p = numbers(cell)
        assert values == shown(gap.estimate, gap.low, gap.high)
        assert p == pytest.approx(gap.p_value, abs=6e-4)


def test_gains_by_class_are_those_of_the_metrics(parsed, answers, truths):
    first, second = answers["semantic"][0], answers["baseline"][0]
    classes = by_hiding_class(truths)
    assert list(parsed.cells("gain-accuracy_10cm")) == ["any object", *classes]
    for name, mask in classes.items():
        gap = compare(first, second, mask, np.random.default_rng(0), N_RESAMPLES)
        for measure in ("accuracy_10cm", "map_10cm"):
            n_frames, n_joints, *cells = parsed.cells(f"gain-{measure}")[name]
            assert (int(n_frames), int(n_joints)) == (mask.any(axis=1).sum(), mask.sum())
            *values, p = numbers(cells[2])
            assert values == shown(gap[measure].estimate, gap[measure].low, gap[measure].high)
            assert p == pytest.approx(gap[measure].p_value, abs=6e-4)


def test_bars_are_as_long_as_the_joints_accuracy(page, answers, truths):
    charts = section(page, "joints").split("</svg>")
    svgs = [chart for chart in charts if 'role="img"' in chart]
    for svg, state in zip(svgs, ("occluded", "non_occluded"), strict=True):
        widths = [float(width) for width in re.findall(r'<rect [^>]*?width="([\d.]+)" height', svg)]
        expected = []
        for joint in truths.joints:
            mask = by_joint(truths)[joint] & by_state(truths)[state]
            expected += [248 * (errors(seeds[0])[mask] <= 0.1).mean() for seeds in answers.values() if mask.any()]
        assert widths == pytest.approx(expected, abs=0.06)


def section(page, name):
    return page.split(f'<section id="{name}">')[1].split("</section>")[0]


def test_means_and_spread_are_over_trainings(tmp_path, toy_corpus, truths):
    answers = answers_of(truths, ("baseline", "semantic"), n_seeds=3)
    cells = Page(page_of(tmp_path, toy_corpus, answers, with_corpus=False)).cells("precision")["Baseline"]
    mask, weights = np.ones(truths.state.shape, bool), np.ones((1, len(truths)), np.int16)
    values = [of(summarise(results, mask, weights), "map_10cm")[0] for results in answers["baseline"]]
    assert numbers(cells[1])[:1] == shown(np.mean(values))
    assert numbers(cells[-2]) == shown(np.std(values, ddof=1))
    assert cells[-1] == "3"


def test_numbers_as_they_are_written():
    assert [number(v, 100.0, sign=True) for v in (0.051, -0.2, -0.0001, None)] == [
        "+5.1",
        f"{MINUS}20.0",
        "0.0",
        NOTHING,
    ]
    assert with_interval(0.5, (0.25, None), 100.0) == f"50.0 [25.0,{SPACE}{NOTHING}]"
    assert [p_value(p).replace(SPACE, " ") for p in (0.0005, 0.001, 0.25, None)] == [
        "p < 0.001", "p = 0.001", "p = 0.250", f"p {NOTHING}",
    ]  # fmt: skip


# Charts


def test_lines_go_from_corner_to_corner():
    x, y = Axis("x", 0.0, 20.0, (0.0, 20.0)), Axis("y", 0.0, 100.0, (0.0, 100.0))
    line = Series(METHODS["semantic"], (Point(0.0, 0.0), Point(5.0, None), Point(20.0, 100.0)))
    assert 'points="46.0,228.0 366.0,10.0"' in line_chart("t", [line], x, y)


def test_equal_ratios_are_equally_long_on_a_log_axis():
    axis = Axis("n", 10.0, 1000.0, (), is_log=True)
    assert [axis.share(v) for v in (10, 100, 1000, 5)] == pytest.approx([0.0, 0.5, 1.0, 0.0])


@pytest.mark.parametrize("values", [[-3.2, 17.0], [0.001], [None, 250.0, -1e3], []])
def test_round_axes_hold_their_values_with_few_ticks(values):
    axis = round_axis("x", values, (-1.0, 1.0))
    assert all(axis.low <= v <= axis.high for v in [*values, -1.0, 1.0] if v is not None)
    assert 3 <= len(axis.ticks) <= 8
    assert np.ptp(np.diff(axis.ticks)) < 1e-6 * (axis.high - axis.low)


# Examples


def test_examples_are_the_frames_at_the_quantiles(page, answers, truths):
    gains = []
    for row, frame in enumerate(truths.frame):
        if (truths.state[row] == JointState.OCCLUDED).any():
            first, second = (
                np.mean([min(e, 0.5) for e in errors(answers[name][0])[row]]) for name in ("semantic", "occluders")
            )
            gains.append((second - first, -row, int(frame)))
    rising = sorted(gains)
    places = [int(place.quantile * (len(rising) - 1) + 0.5) for place in PLACES]
    assert [int(n) for n in re.findall(r'id="frame-(\d+)"', page)] == [rising[k][2] for k in places]
    told = [numbers(words)[0] for words in re.findall(r"Gain (\S+) cm", page)]
    assert told == pytest.approx([100 * rising[k][0] for k in places], abs=0.051)
    assert told == sorted(told, reverse=True)


def test_examples_are_frames_in_which_something_is_hidden_if_there_are_any(tmp_path, toy_corpus, truths):
    is_bare = (np.arange(len(truths)) % 3 > 0)[:, None] & (truths.state == JointState.OCCLUDED)
    partly = replace(truths, state=np.where(is_bare, JointState.OUTSIDE, truths.state).astype(np.uint8))
    text = page_of(tmp_path, toy_corpus, answers_of(partly, ("occluders", "semantic")))
    numbers = {int(n) for n in re.findall(r'id="frame-(\d+)"', text)}
    assert numbers <= set(truths.frame[::3].tolist())
    assert "hides a joint (10) are ordered" in text


def test_a_frame_is_shown_once_and_the_earlier_of_equals():
    rows, gain = np.array([4, 7, 9]), np.array([0.0, 0.0, 0.0])
    shown = at_quantiles(rows, gain, (Place(1.0, "most"), Place(0.0, "least"), Place(0.1, "few")))
    assert [(item.row, item.words) for item in shown] == [(9, "most"), (4, "least")]


def test_pixel_labels_are_shown_of_models_that_are_there(tmp_path, toy_corpus, truths, monkeypatch):
    class Labeller:
        classes = ("head",)

        def label_pixels(self, depth, camera):
            return (depth > 0).astype(np.uint8)

    asked = []

    def load(path):
        asked.append(path.name)
        return Contestant(path.stem, Labeller(), truths.joints, Labeller()), {}

    monkeypatch.setattr("pipelines.report.models.open_model", load)
    answers = answers_of(truths, ("baseline", "occluders", "semantic", "rwf"))
    made = write_folder(tmp_path / "a", toy_corpus, answers, models=("baseline", "semantic", "rwf"))
    (made / "models/baseline-0.safetensors").write_bytes(b"another forest")
    page = report_page(read_source(made, toy_corpus.path))
    assert asked == ["semantic-0.safetensors"]
    assert page.count('alt="labels, with semantics"') == page.count('alt="depth"') > 0
    assert 'alt="labels, without semantics"' not in page
    assert "labels of pixels of Baseline, OARF without semantics; their models are not there" in page


# Kinds of models


def test_every_method_has_a_kind_that_is_described():
    settings = AblationConfig().plain()
    told = {kind: KINDS[kind].describe(settings[kind]) for kind in kinds_of(METHODS)}
    assert [figure.paper for figure in told["oarf"].figures][:2] == ["3", "20"]
    assert "perfect detector" in told["rwf"].differences[0]


def test_of_each_kind_the_method_that_knows_most_is_drawn():
    assert shown_methods(METHODS) == ("semantic", "rwf", "heat_classes")
    assert shown_methods(("rwf_body", "baseline")) == ("baseline", "rwf_body")
    assert shown_methods(("occluders",)) == ("occluders",)


# What is missing


def test_what_the_data_do_not_hold_is_left_out_in_a_line(tmp_path, toy_corpus, truths):
    text = page_of(tmp_path, toy_corpus, answers_of(truths, ("semantic",)), with_corpus=False)
    page = Page(text)
    assert "Random walks" not in text
    assert "Every method was trained once" in text
    assert "there is nothing to compare" in text
    for name, why in {
        "classes": "it needs two of the regression forests",
        "examples": "they need two methods",
        "questions": "the ablation asked none",
        "reliability": "no method tells calibrated probabilities",
    }.items():
        assert re.search(rf'<p class="missing">Left out: {why}[^<]*</p>$', section(text, name))
        assert f"#{name}" not in page.links


def test_without_the_corpus_all_but_pictures_is_there(folder, page):
    text = report_page(read_source(folder))
    assert "Left out: the corpus is not there." in section(text, "examples")
    assert [section(text, name) == section(page, name) for name in ("map", "joints", "classes")] == [True] * 3


def test_a_corpus_in_which_nothing_is_hidden(tmp_path, toy_corpus, truths):
    state = np.where(truths.state == JointState.OCCLUDED, JointState.VISIBLE, truths.state).astype(np.uint8)
    bare = replace(truths, state=state, hiding_class=np.zeros_like(truths.hiding_class))
    text = page_of(tmp_path, toy_corpus, answers_of(bare, ("baseline", "occluders", "semantic")))
    page = Page(text)
    assert "of which an object hides 0" in text
    assert [row[3] for row in page.cells("precision").values()] == [NOTHING] * 3
    assert "Left out: no joint of the test frames is hidden by an object." in section(text, "classes")
    assert "all test frames (30)" in section(text, "examples")
    assert not re.search(r"\b(nan|inf|None)\b", text)


def test_methods_of_other_joints_stand_side_by_side(tmp_path, toy_corpus, truths):
    answers = answers_of(truths, ("occluders", "semantic", "rwf"))
    answers["rwf"] = [results.of_joints(("neck", "head")) for results in answers["rwf"]]
    text = page_of(tmp_path, toy_corpus, answers)
    page = Page(text)
    assert list(page.cells("precision-differences")) == [SEMANTICS]
    assert "Random walks, learned with objects" in page.cells("precision")


def test_probabilities_are_held_against_what_happened(tmp_path, toy_corpus, truths):
    xyz, probability = truths.xyz.copy(), np.full(truths.state.shape, 0.95, np.float32)
    xyz[:, 0], probability[:19, 1] = np.nan, 0.05
    partly = replace(truths, xyz=xyz)
    answers = answers_of(partly, ("baseline", "semantic"))
    # Right wherever there is a truth; nineteen joints are too few for a point of their own.
    sure = replace(
        answers["baseline"][0],
        proposals=np.repeat(np.nan_to_num(xyz, nan=1.0)[:, :, None], 3, axis=2),
        probability=probability,
    )
    text = page_of(tmp_path, toy_corpus, {**answers, "baseline": [sure]}, with_corpus=False)
    own = section(text, "reliability")
    assert own.count('role="img"') == 1
    assert re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', own.split("</ul>")[1]) == [("350.0", "10.0")]
    assert "OARF with semantics" not in own


def test_questions_show_their_conditions(tmp_path, toy_corpus, truths):
    answers = answers_of(truths, ("baseline", "occluders", "semantic"))
    weights = draw_frames(len(truths), 20, np.random.default_rng(0))
    condition = {
        "rows": {row: row_scores(seeds, weights) for row, seeds in answers.items()},
        "differences": pair_scores(answers, Resampling(20)),
    }
    questions = {
        "trees": [{"settings": {"n_trees": n}, **condition} for n in (1, 3)],
        "sensor": [{"settings": {"in_training": None, "in_test": "kinect_v2"}, **condition}],
        "imported": [
            {"settings": {"poses": poses, "objects": "imported"}, **condition}
            for poses in ("procedural", "recorded")
        ],
        "pixels": [],
    }
    text = page_of(tmp_path, toy_corpus, answers, with_corpus=False, questions=questions)
    page = Page(text)
    of_trees = page.cells("question-trees-occluded")
    assert list(of_trees) == ["1", "3"]
    scores = condition["rows"]["semantic"]["occluded"]
    assert numbers(of_trees["3"][3]) == shown(scores["map_10cm"], *scores["map_10cm_ci"])
    assert page.cells("question-sensor-all")["clean"][0] == "kinect_v2"
    of_imported = page.cells("question-imported-all")
    assert list(of_imported) == ["procedural", "recorded"]
    assert of_imported["recorded"][0] == "imported"
    assert text.count("The forests are those of the main table") == 1
    assert section(text, "questions").count('role="img"') == 2


# What is wrong


def damaged(folder, tmp_path, change):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    document = json.loads((copy / "ablation.json").read_text())
    change(copy, document)
    return copy


def cut(copy, document):
    (copy / "ablation.json").write_text(json.dumps(document)[:-9])


def rewritten(**changes):
    return lambda copy, document: (copy / "ablation.json").write_text(json.dumps(document | changes))


def other_rows(copy, document):
    shutil.copy(copy / "rows/semantic-0.npz", copy / "rows/baseline-0.npz")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda copy, document: (copy / "ablation.json").unlink(),
            "is not the folder of an ablation: it has no ablation.json",
        ),
        (cut, "ablation.json is damaged, or not "),
        (rewritten(schema_version=2), "holds ('undergrowth ablation', 2); this program reads "),
        (rewritten(main={"rows": {"kinect": {}}}), "has the rows kinect; known are baseline, "),
        (lambda copy, document: (copy / "rows/rwf-0.npz").unlink(), "there is no file "),
        (other_rows, "baseline-0.npz is not the file of rows that ablation.json names"),
    ],
)  # fmt: skip
def test_a_damaged_folder_is_one_line(folder, tmp_path, capsys, change, message):
    copy = damaged(folder, tmp_path, change)
    assert main(["report", str(copy)]) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (copy / "report.html").exists()


def test_another_corpus_is_refused(toy_corpus, tmp_path, answers, capsys):
    made = write_folder(tmp_path / "a", toy_corpus, {"semantic": answers["semantic"]})
    document = json.loads((made / "ablation.json").read_text())
    document["corpora"][0]["digest"] = "0" * 64
    (made / "ablation.json").write_text(json.dumps(document))
    assert main(["report", str(made), "--corpus", str(toy_corpus.path)]) == 1
    assert f"but the ablation used a corpus with the digest {'0' * 64}" in capsys.readouterr().err


# In a browser

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FITS = """<body style="margin:0"><iframe id="f" src="page.html" style="border:0;width:{}px;height:900px"></iframe>
<script>f.onload = () => {{ const page = f.contentDocument.documentElement;
document.title = page.scrollWidth + " of " + page.clientWidth }}</script>"""


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or google-chrome")
@pytest.mark.parametrize("width", [1200, 390])
def test_the_page_is_no_wider_than_the_screen(page, tmp_path, width):
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    (tmp_path / "frame.html").write_text(FITS.format(width))
    options = [
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--allow-file-access-from-files",
        "--dump-dom",
    ]
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    command = [BROWSER, *options, profile, "--window-size=1300,1000", f"file://{tmp_path / 'frame.html'}"]
    dom = subprocess.run(command, capture_output=True, text=True, check=True, timeout=100).stdout
    assert f"<title>{width} of {width}</title>" in dom
