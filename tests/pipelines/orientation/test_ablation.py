"""Table 4 of Beyer et al. 2015 at a toy size: planned, interrupted, gone on with, drawn."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nets.orientation.angles import wrapped
from nets.orientation.config import VIEWS, OrientationConfig
from nets.patches import MISSING
from pipelines.errors import UserError
from pipelines.orientation import ablation
from pipelines.orientation.ablation import (
    OrientationAblationConfig,
    ablation_config,
    run_orientation_ablation,
    trainings_of,
)
from pipelines.orientation.table import counts_picture, table_lines, turning_picture
from pipelines.orientation.turning import turning_patches

NET = OrientationConfig(n_epochs=1, batch_size=10, auxiliary_weight=0.0)
TINY = OrientationAblationConfig(
    train_frames=140,
    val_frames=30,
    test_frames=30,
    bins=(4, 0),
    outputs=("softmax_centres", "softmax_interpolated", "biternion_cosine"),
    n_seeds=2,
    sensor=None,
    net=NET,
)


def test_the_papers_table_is_planned_whole():
    trainings = trainings_of(OrientationAblationConfig())
    assert len(trainings) == len({training.name for training in trainings}) == 5 * (6 * 5 + 4)
    cells = {(output, training.config.n_bins) for training in trainings for output in training.outputs}
    assert len(cells) == 6 * 6 + 4
    kappas = {training.config.output: training.config.kappa for training in trainings}
    assert (kappas["von_mises"], kappas["biternion_von_mises"]) == (0.5, 1.0)
    assert trainings[33].config.seed == 0
    assert trainings[34].config.seed == 1


def test_a_file_changes_what_it_tells_alone(tmp_path):
    (tmp_path / "a.toml").write_text("bins = [4]\n[net]\nn_epochs = 3\n")
    config = ablation_config(tmp_path / "a.toml")
    assert config == replace(OrientationAblationConfig(), bins=(4,), net=replace(config.net, n_epochs=3))
    assert replace(config.net, n_epochs=20) == OrientationAblationConfig().net
    (tmp_path / "b.toml").write_text("net = 3\n")
    with pytest.raises(UserError, match="net=3 must be a table"):
        ablation_config(tmp_path / "b.toml")


def test_values_that_stand_twice_are_refused():
    with pytest.raises(ValueError, match="bins=\\[4, 4\\] must hold at least one value, all different"):
        replace(TINY, bins=(4, 4))


def test_the_corpus_is_the_one_that_was_asked_for(tmp_path, monkeypatch, toy_corpus):
    asked = []

    def generate(out, scene, n_frames, seed, workers):
        asked.append(
            (out, scene.splits.counts(n_frames), scene.scenes.unhidden, scene.scenes.table, seed, workers)
        )
        raise KeyboardInterrupt

    monkeypatch.setattr(ablation, "generate_corpus", generate)
    with pytest.raises(KeyboardInterrupt):
        run_orientation_ablation(replace(TINY, corpus_seed=7), tmp_path, 2)
    assert asked == [(tmp_path / "corpus", (140, 30, 30), 1.0, 0.0, 7, 2)]


def test_an_interrupted_ablation_goes_on_to_the_same_scores(tmp_path, monkeypatch, toy_corpus):
    pytest.importorskip("torch", reason="torch is not installed")
    monkeypatch.setattr(ablation, "generate_corpus", lambda *arguments: toy_corpus)
    frames_of = ablation.frames_of
    few = ablation.cut_patches(frames_of([toy_corpus], "test", TINY.net, None, 5), TINY.net)
    monkeypatch.setattr(ablation, "turning_patches", lambda *arguments: few)
    monkeypatch.setattr(ablation, "frames_of", lambda *arguments: frames_of(*arguments[:-1], 20))
    whole = run_orientation_ablation(TINY, tmp_path / "whole")
    do, n_done = ablation._do, 0

    def do_two(*arguments):
        nonlocal n_done
        if n_done == 2:
            raise KeyboardInterrupt
        n_done += 1
        do(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(ablation, "_do", do_two)
        with pytest.raises(KeyboardInterrupt):
            run_orientation_ablation(TINY, tmp_path / "stopped")
    assert len(list((tmp_path / "stopped" / "rows").iterdir())) == 2
    assert run_orientation_ablation(TINY, tmp_path / "stopped") == whole
    assert json.loads((tmp_path / "stopped" / ablation.DOCUMENT_NAME).read_text()) == whole
    assert not list((tmp_path / "whole").glob("*.safetensors*"))
    cells = {(cell["output"], cell["n_bins"]): cell for cell in whole["cells"]}
    assert sorted(cells) == sorted(
        {("biternion_cosine", 0), ("biternion_cosine", 4), ("softmax_centres", 4), ("softmax_interpolated", 4)}
    )
    for cell in cells.values():
        assert np.sum(cell["counts"]) == 2 * whole["n_test"]
        assert cell["mean_error_deg"] == pytest.approx(np.mean(cell["of_seeds_deg"]))
    lines = list(table_lines(whole))
    assert len(lines) == 4
    assert "±" in lines[2]
    assert counts_picture(whole).ndim == 3
    drawn, other = turning_picture(whole, 4), turning_picture(whole, 0)
    assert drawn.shape == other.shape
    assert (drawn != other).any()


@pytest.mark.slow
def test_who_turns_is_seen_from_every_side():
    patches = turning_patches(3, 12, "body", NET.view, None)
    steps = wrapped(np.diff(patches.angle, append=patches.angle[:1]))
    np.testing.assert_allclose(np.abs(steps), 2.0 * np.pi / 12, atol=1e-5)
    assert len(np.unique(np.sign(steps))) == 1
    assert (patches.relative != MISSING).any(axis=(1, 2)).all()
    heads = turning_patches(3, 4, "head", VIEWS["head", "small"], None)
    assert np.isfinite([heads.angle, heads.tilt, heads.roll]).all()
