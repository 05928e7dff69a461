"""The kinds of models. A row tells how one is trained, stored, opened, varied and described; nothing else does.

Adding a kind is a row here and a package of its own. Rows name functions, which import the package when they are
called, so that reading this table costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from pipelines.errors import UserError
from pipelines.models import describing
from pipelines.models.describing import Description

if TYPE_CHECKING:
    import numpy as np

    from forests.estimate import JointPredictor
    from forests.frames import LabelTable
    from storage.digested import Contents


Marker = Literal["disc", "square", "diamond", "triangle", "cross"]


class ModelConfig(Protocol):
    """Settings of a training: a frozen dataclass."""

    @property
    def seed(self) -> int:
        """Seed of everything that training draws."""
        ...


class Tools(NamedTuple):
    """The functions of a kind's package.

    Attributes:
        train: Frames and a config to a model, with finished trees in a `TreeStore`.
        save: Writes a model and metadata to a file.
        open: A file's path and contents to a model ready to be asked.
        predictor: A trained model ready to be asked.
        pack_tree: A tree as arrays.
        unpack_tree: Arrays, label table and config to a tree.
    """

    train: Callable[..., Any]
    save: Callable[[Path, Any, dict[str, Any]], None]
    open: Callable[[Path, Contents], JointPredictor]
    predictor: Callable[[Any], JointPredictor]
    pack_tree: Callable[[Any], dict[str, np.ndarray]]
    unpack_tree: Callable[[dict[str, np.ndarray], LabelTable, Any], Any]


@dataclass(frozen=True)
class Variant:
    """A way of training that an ablation compares with others, and how it is drawn (colours of Okabe and Ito).

    Attributes:
        settings: What it sets of the kind's settings.
        title: In tables.
        short: Over pictures.
        colour: As CSS has it.
        dash: SVG dash pattern, empty for a full line.
        marker: At points.
    """

    settings: Mapping[str, object]
    title: str
    short: str
    colour: str
    dash: str
    marker: Marker


@dataclass(frozen=True)
class ModelKind:
    """A kind of model.

    Attributes:
        name: In model files, and as a word of `undergrowth train`.
        title: In sentences.
        config_class: The class of its settings.
        tools: The functions of its package.
        variants: The ways of training that an ablation compares, by the name of its row; the one that knows most
            is last.
        needs_objects: Whether a training with these settings learns from frames that show objects.
        training_s: About how long a training takes on one core [s], by settings, training and validation frames.
        describe: What a report tells of it, by its settings as JSON values.
        reduced: The model with its first trees and other voting pixels alone, 0 = as trained; None: it has none.
        piece: What an interrupted training goes on after.
        is_net: Whether it is a net, which needs torch, and depends on the number of threads.
        learns_rooms: Whether it can learn from people in whole scenes.
    """

    name: str
    title: str
    config_class: Callable[[], type]
    tools: Callable[[], Tools]
    variants: Mapping[str, Variant]
    needs_objects: Callable[[Any], bool]
    training_s: Callable[[Any, int, int], float]
    describe: Callable[[Mapping[str, Any]], Description]
    reduced: Callable[[JointPredictor, int, int], JointPredictor] | None = None
    piece: str = "tree"
    is_net: bool = False
    learns_rooms: bool = True


def _oarf_config() -> type:
    from forests.oarf.config import OARFConfig

    return OARFConfig


def _oarf_tools() -> Tools:
    from forests.kinds import predictor_of
    from forests.oarf.predict import Predictor
    from forests.oarf.storage import pack_tree, save_model, unpack_tree
    from forests.oarf.train import train

    return Tools(train, save_model, predictor_of, Predictor, pack_tree, unpack_tree)


def _oarf_training_s(config: Any, n_train: int, n_val: int) -> float:
    """11 us a sample and tree, 40 ms a frame to tune on."""
    n_pixels = config.n_pixels + (config.mode != "baseline") * config.n_occluder_pixels
    return 0.04 * n_val + 11e-6 * config.n_trees * n_pixels * n_train


def _oarf_reduced(predictor: JointPredictor, n_trees: int, n_voting_pixels: int) -> JointPredictor:
    from forests.oarf.predict import Predictor

    assert isinstance(predictor, Predictor)
    model = predictor.model
    config = replace(model.config, n_voting_pixels=n_voting_pixels or model.config.n_voting_pixels)
    return Predictor(replace(model, config=config, trees=model.trees[: n_trees or None]))


def _rwf_config() -> type:
    from forests.rwf.config import RWFConfig

    return RWFConfig


def _rwf_tools() -> Tools:
    from forests.kinds import predictor_of
    from forests.rwf.predict import Predictor
    from forests.rwf.storage import pack_tree, save_model, unpack_tree
    from forests.rwf.train import train

    return Tools(train, save_model, predictor_of, Predictor, pack_tree, unpack_tree)


def _rwf_training_s(config: Any, n_train: int, n_val: int) -> float:
    """7 us a point, tree and joint; 120 ms a frame to tune on, in one thread."""
    n_joints = len(config.joints) or len(config.skeleton)
    n_images = (1.0 + config.cut_share) * n_train
    return 0.12 * n_val + 7e-6 * n_joints * config.n_trees * config.n_points * n_images


def _heatmap_config() -> type:
    from nets.heatmap.config import HeatmapConfig

    return HeatmapConfig


def _heatmap_tools() -> Tools:
    from nets.runtime import MissingLibraryError, load_torch

    try:
        load_torch()
    except MissingLibraryError as error:
        raise UserError(str(error)) from None
    from nets.heatmap.predict import HeatmapPredictor
    from nets.heatmap.storage import save_model, unpack_model
    from nets.heatmap.train import train

    def opened(path: Path, contents: Contents) -> JointPredictor:
        from forests.modelfile import naming_file

        with naming_file(path):
            return HeatmapPredictor(unpack_model(contents.arrays, contents.metadata))

    def unpacked(arrays: dict[str, np.ndarray], labels: LabelTable, config: Any) -> dict[str, np.ndarray]:
        return arrays

    return Tools(train, save_model, opened, HeatmapPredictor, dict, unpacked)


def _heatmap_training_s(config: Any, n_train: int, n_val: int) -> float:
    """12 ms an image and epoch, in one thread."""
    return 0.02 * (n_train + n_val) + 0.012 * config.n_epochs * n_train


KINDS: Mapping[str, ModelKind] = {
    kind.name: kind
    for kind in (
        ModelKind(
            name="oarf",
            title="regression forest",
            config_class=_oarf_config,
            tools=_oarf_tools,
            variants={
                "baseline": Variant({"mode": "baseline"}, "Baseline", "baseline", "currentColor", "2 3", "disc"),
                "occluders": Variant(
                    {"mode": "occluders"},
                    "OARF without semantics",
                    "without semantics",
                    "#0072b2",
                    "7 3",
                    "square",
                ),
                "semantic": Variant(
                    {"mode": "semantic"}, "OARF with semantics", "with semantics", "#d55e00", "", "diamond"
                ),
            },
            needs_objects=lambda config: config.mode != "baseline",
            training_s=_oarf_training_s,
            describe=describing.regression_forest,
            reduced=_oarf_reduced,
        ),
        ModelKind(
            name="rwf",
            title="random walk forest",
            config_class=_rwf_config,
            tools=_rwf_tools,
            variants={
                "rwf_body": Variant(
                    {"layer": "body"},
                    "Random walks, learned from bodies",
                    "random walks, bodies",
                    "#cc79a7",
                    "1 2",
                    "triangle",
                ),
                "rwf": Variant(
                    {"layer": "composite"},
                    "Random walks, learned with objects",
                    "random walks",
                    "#009e73",
                    "8 3 2 3",
                    "cross",
                ),
            },
            needs_objects=lambda config: False,
            training_s=_rwf_training_s,
            describe=describing.random_walk_forest,
        ),
        ModelKind(
            name="heatmap",
            title="heat map net",
            config_class=_heatmap_config,
            tools=_heatmap_tools,
            variants={
                "heat_body": Variant(
                    {"layer": "body"},
                    "Heat maps, learned from bodies",
                    "heat maps, bodies",
                    "#e69f00",
                    "1 2",
                    "disc",
                ),
                "heat": Variant(
                    {"layer": "composite", "naming": "none"},
                    "Heat maps, learned with objects",
                    "heat maps",
                    "#56b4e9",
                    "8 3 2 3",
                    "square",
                ),
                "heat_object": Variant(
                    {"layer": "composite", "naming": "one_class"},
                    "Heat maps that tell objects",
                    "heat maps, objects",
                    "#0072b2",
                    "4 2",
                    "diamond",
                ),
                "heat_classes": Variant(
                    {"layer": "composite", "naming": "each_class"},
                    "Heat maps that tell classes of objects",
                    "heat maps, classes",
                    "#d55e00",
                    "",
                    "triangle",
                ),
            },
            needs_objects=lambda config: config.layer == "composite",
            training_s=_heatmap_training_s,
            describe=lambda config: Description((), ()),
            piece="epoch",
            is_net=True,
            learns_rooms=False,
        ),
    )
}
"""All kinds by name."""

COMPARED: Mapping[str, ModelKind] = {name: kind for name, kind in KINDS.items() if kind.variants}
"""The kinds that an ablation compares."""
VARIANTS: Mapping[str, ModelKind] = {variant: kind for kind in KINDS.values() for variant in kind.variants}
"""The kind of every variant, in the order in which an ablation shows them."""


def kind_named(name: str, where: Path) -> ModelKind:
    """The kind that a model file names.

    Raises:
        UserError: It is unknown.
    """
    if name not in KINDS:
        raise UserError(f"{where} holds a model of kind {name!r}; known are {', '.join(KINDS)}")
    return KINDS[name]
