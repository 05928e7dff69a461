"""Table 4 of Beyer et al. 2015 on generated heads: outputs and costs against labels in ever coarser sectors."""

import hashlib
import io
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.records import to_json
from nets.orientation.angles import angular_error, wrapped
from nets.orientation.config import OUTPUTS, OrientationConfig, Output
from nets.orientation.decode import decode_crops
from nets.orientation.frames import Patches
from pipelines.corpus import Corpus
from pipelines.corpus.folder import locked_folder
from pipelines.generation.writing import generate_corpus
from pipelines.metrics.arrayfile import read_arrays
from pipelines.orientation.training import cut_patches, frames_of, identity_of, train_into
from pipelines.orientation.turning import turning_patches
from pipelines.progress import Progress
from pipelines.settings import from_table, read_toml
from storage.atomic import write_atomically
from storage.ranges import MAX_FRAMES, MAX_SEED, check_fields
from synth.scene import SceneConfig
from synth.scene.config import SceneWeights, SplitShares

if TYPE_CHECKING:
    from nets.orientation.model import OrientationModel

SCHEMA = "undergrowth orientation ablation"
SCHEMA_VERSION = 1
DOCUMENT_NAME = "orientation.json"
N_VIEWS = 72
"""Views of the person who turns."""
_TURNING_SEED = 7
N_CELLS = 36
"""Cells of the counts of answers against the truth, along each side."""


_NOTHING_HIDES = SceneWeights(
    unhidden=1.0, table=0.0, laptop_table=0.0, laptop_lap=0.0, stroller=0.0, clutter=0.0, several=0.0
)


def _papers_net() -> OrientationConfig:
    """The paper's net and augmentation: mirrors and crops alone, and no second output."""
    return OrientationConfig(
        region="head",
        architecture="paper",
        n_epochs=20,
        batch_size=32,
        cut_share=0.0,
        hole_share=0.0,
        depth_jitter_m=0.0,
        scale_jitter=0.0,
        auxiliary_weight=0.0,
    )


@dataclass(frozen=True)
class OrientationAblationConfig:
    """The settings of an ablation of orientation nets.

    Attributes:
        train_frames: Number of training frames.
        val_frames: Number of frames on which concentrations are calibrated.
        test_frames: Number of frames for scoring, with other subjects and poses.
        corpus_seed: Seed of the corpus.
        scene: How the scenes are drawn, apart from the splits; by default people whom nothing hides, seen
            from all sides alike.
        sensor: Sensor model for the depth; None = clean.
        bins: Numbers of sectors; 0 = true angles, which classes cannot learn from.
        outputs: What nets put out and are trained with.
        n_seeds: Trainings of each, with seeds counted on from the net's own.
        plain_kappa: Concentration in the von Mises cost of plain angles; the net's own is that of biternions.
        net: How nets are trained; output, bins and seed are set by the ablation.
    """

    train_frames: int = 3000
    val_frames: int = 200
    test_frames: int = 1000
    corpus_seed: int = 2015
    scene: SceneConfig = field(default_factory=lambda: SceneConfig(scenes=_NOTHING_HIDES, frontal_share=0.0))
    sensor: str | None = "kinect_v2"
    bins: tuple[int, ...] = (3, 4, 6, 8, 10, 12, 0)
    outputs: tuple[Output, ...] = OUTPUTS
    n_seeds: int = 5
    plain_kappa: float = 0.5
    net: OrientationConfig = field(default_factory=_papers_net)

    def __post_init__(self) -> None:
        ranges: dict[str, tuple[float, float]] = {
            "n_seeds": (1, 1000),
            "corpus_seed": (0, MAX_SEED),
            "bins": (0, 360),
            "plain_kappa": (0.01, 100.0),
        }
        frames = ("train_frames", "val_frames", "test_frames")
        check_fields(self, ranges | dict.fromkeys(frames, (1, MAX_FRAMES // 3)))
        for name in ("bins", "outputs"):
            given = getattr(self, name)
            if not given or len(set(given)) < len(given):
                raise ValueError(f"{name}={list(given)} must hold at least one value, all different")


def ablation_config(path: Path | None) -> OrientationAblationConfig:
    """The settings, with those of a TOML file before the defaults; of the net it need not tell all.

    Raises:
        UserError: The file is missing, no TOML, or has unknown or wrong settings.
    """
    table: dict[str, Any] = {} if path is None else read_toml(path)
    net = table.get("net", {})
    if isinstance(net, dict):
        table["net"] = to_json(_papers_net()) | net
    return from_table(OrientationAblationConfig, table, str(path))


class Training(NamedTuple):
    """One training.

    Attributes:
        name: Of its files.
        config: Its settings.
        outputs: What it is scored as; one training of classes is read in two ways.
    """

    name: str
    config: OrientationConfig
    outputs: tuple[Output, ...]


def trainings_of(config: OrientationAblationConfig) -> list[Training]:
    """All trainings, seed by seed, so that an unfinished ablation has every cell of the table."""
    out = []
    for seed in range(config.n_seeds):
        for n_bins in config.bins:
            for outputs in _trained_alike(config.outputs):
                if outputs[0].startswith("softmax") and not n_bins:
                    continue
                kappa = config.plain_kappa if outputs[0] == "von_mises" else config.net.kappa
                net = replace(
                    config.net, output=outputs[0], n_bins=n_bins, kappa=kappa, seed=config.net.seed + seed
                )
                label = "softmax" if outputs[0].startswith("softmax") else outputs[0]
                out.append(Training(f"{label}_{n_bins or 'true'}_{net.seed}", net, outputs))
    return out


def _trained_alike(outputs: tuple[Output, ...]) -> Iterator[tuple[Output, ...]]:
    """Outputs in groups that one training serves."""
    classes = tuple(output for output in outputs if output.startswith("softmax"))
    for output in outputs:
        if output not in classes:
            yield (output,)
        elif output == classes[0]:
            yield classes


def run_orientation_ablation(config: OrientationAblationConfig, out: Path, n_workers: int = 1) -> dict[str, Any]:
    """Does all work that is not yet done, scores it, writes orientation.json.

    Args:
        config: What is asked.
        out: Folder for corpus, rows and orientation.json; finished work of the same settings in it is used again.
        n_workers: Processes that make frames. Nets are trained in one thread, whose weights repeat.

    Returns:
        What orientation.json holds, see docs/orientation.md.

    Raises:
        UserError: A folder in use or with work of other settings, a full disk, or damaged files in the folder.
    """
    (out / "rows").mkdir(parents=True, exist_ok=True)
    with locked_folder(out):
        corpus = generate_corpus(out / "corpus", _scene(config), _n_frames(config), config.corpus_seed, n_workers)
        train, val, test = (
            cut_patches(frames_of([corpus], split, config.net, config.sensor, 0), config.net)
            for split in ("train", "val", "test")
        )
        turning = turning_patches(_TURNING_SEED, N_VIEWS, config.net.region, config.net.view, config.sensor)
        trainings = trainings_of(config)
        with Progress(len(trainings), "training", "ablate orientation") as bar:
            for training in trainings:
                _do(training, out, corpus, config, (train, val, test, turning))
                bar.update()
        document = _document(config, corpus, out, trainings, (test, turning))
        write_atomically(out / DOCUMENT_NAME, json.dumps(document, indent=1, allow_nan=False) + "\n")
    return document


def _n_frames(config: OrientationAblationConfig) -> int:
    return config.train_frames + config.val_frames + config.test_frames


def _scene(config: OrientationAblationConfig) -> SceneConfig:
    shares = SplitShares(float(config.train_frames), float(config.val_frames), float(config.test_frames))
    return replace(config.scene, splits=shares)


def _rows_file(out: Path, training: Training, identity: dict[str, Any]) -> Path:
    """Its name says what the answers depend on, so that those of other settings are not taken for them."""
    key = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:12]
    return out / "rows" / f"{training.name}-{key}.npz"


def _do(
    training: Training,
    out: Path,
    corpus: Corpus,
    config: OrientationAblationConfig,
    patches: tuple[Patches, Patches, Patches, Patches],
) -> None:
    """Trains, asks about the test heads, keeps what the net puts out, and drops the net."""
    from nets.orientation.storage import load_model

    identity = identity_of([corpus], training.config, config.sensor, 0, 1)
    rows = _rows_file(out, training, identity)
    if rows.exists():
        return
    train, val, test, turning = patches
    model = out / f"{training.name}.safetensors"
    if not model.exists():
        train_into(
            model, training.config, train, val, identity=identity, metadata=lambda _: identity, drops_others=True
        )
    net = load_model(model)
    raw, told = _outputs(net, test.relative)
    file = io.BytesIO()
    np.savez(file, angle=raw, log_concentration=told, turning=_outputs(net, turning.relative)[0])
    write_atomically(rows, file.getvalue())
    model.unlink()


def _outputs(
    model: "OrientationModel", relative: NDArray[np.int16]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(n, n_crops, n_angle) and (n,): what a net puts out about patches."""
    from nets.orientation.network import net_of
    from nets.orientation.predict import n_crops_of, raw_outputs
    from nets.runtime import repeatable

    n_crops = n_crops_of(model.config)
    with repeatable():
        raw = raw_outputs(net_of(model.config, model.weights), model.config, relative)
    told = raw.log_concentration.reshape(-1, n_crops).mean(axis=1)
    return raw.angle.reshape(-1, n_crops, model.config.n_angle), told


def _document(
    config: OrientationAblationConfig,
    corpus: Corpus,
    out: Path,
    trainings: list[Training],
    patches: tuple[Patches, Patches],
) -> dict[str, Any]:
    test, turning = patches
    cells: dict[tuple[str, int], list[tuple[NDArray[np.float64], NDArray[np.float64]]]] = {}
    for training in trainings:
        identity = identity_of([corpus], training.config, config.sensor, 0, 1)
        raw = read_arrays(_rows_file(out, training, identity), ["angle", "turning"])
        for output in training.outputs:
            answers = decode_crops(raw["angle"], output), decode_crops(raw["turning"], output)
            cells.setdefault((output, training.config.n_bins), []).append(answers)
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "configuration": json.loads(json.dumps(asdict(config))),
        "corpus": {"digest": corpus.digest},
        "software": identity_of([corpus], config.net, config.sensor, 0, 1)["software"],
        "net": to_json(config.net),
        "n_test": len(test.angle),
        "turning_rad": turning.angle.astype(float).tolist(),
        "cells": [
            _cell(output, n_bins, [answer for answer, _ in answers], test)
            | {"turning_rad": answers[0][1].tolist(), "roughness_deg": _roughness(answers[0][1], turning)}
            for (output, n_bins), answers in cells.items()
        ],
    }


def _roughness(answer: NDArray[np.float64], turning: Patches) -> float:
    """Mean change of the error from one view to the next, of the person who turns [degrees]: 0 = as smooth as true."""
    error = answer - turning.angle
    return float(np.degrees(np.abs(wrapped(np.diff(error, append=error[:1])))).mean())


def _cell(output: str, n_bins: int, answers: list[NDArray[np.float64]], test: Patches) -> dict[str, Any]:
    """One cell of the table: means of the errors of each seed, their mean and deviation, and counts for figure 1."""
    errors = np.degrees([angular_error(answer, test.angle) for answer in answers])
    means = errors.mean(axis=1)
    edges = np.linspace(-np.pi, np.pi, N_CELLS + 1)
    told, true = np.concatenate(answers), np.tile(test.angle, len(answers))
    counts = np.histogram2d(told, true, (edges, edges))[0].astype(np.int64)
    return {
        "output": output,
        "n_bins": n_bins,
        "mean_error_deg": float(means.mean()),
        "deviation_of_seeds_deg": float(means.std(ddof=1)) if len(means) > 1 else None,
        "deviation_of_heads_deg": float(errors.std(axis=1).mean()),
        "of_seeds_deg": means.tolist(),
        "counts": counts.tolist(),
    }
