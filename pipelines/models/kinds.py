"""The kinds of models. A row tells how one is trained, stored, opened, varied and described; nothing else does.

Adding a kind is a row here and a package of its own. Rows name functions, which import the package when they are
called, so that reading this table costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from pipelines.errors import UserError

if TYPE_CHECKING:
    import numpy as np

    from forests.frames import LabelTable
    from pipelines.models.asking import JointPredictor


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
        open: Reads a file and makes the model ready to be asked.
        predictor: A trained model ready to be asked.
        pack_tree: A tree as arrays.
        unpack_tree: Arrays, label table and config to a tree.
    """

    train: Callable[..., Any]
    save: Callable[[Path, Any, dict[str, Any]], None]
    open: Callable[[Path], JointPredictor]
    predictor: Callable[[Any], JointPredictor]
    pack_tree: Callable[[Any], dict[str, np.ndarray]]
    unpack_tree: Callable[[dict[str, np.ndarray], LabelTable, Any], Any]


@dataclass(frozen=True)
class ModelKind:
    """A kind of model.

    Attributes:
        name: In model files, and as a word of `undergrowth train`.
        title: In sentences.
        config_class: The class of its settings.
        tools: The functions of its package.
        variants: Settings by name of a row of the ablation: the ways of training that are compared.
        needs_objects: Whether a training with these settings learns from frames that show objects.
        training_s: About how long a training takes on one core [s], by settings, training and validation frames.
        given: What it is told beside the depth image when it is scored, as a sentence; None for nothing. Takes the
            settings as JSON values.
        reduced: The model with its first trees and other voting pixels alone, 0 = as trained; None: it has none.
    """

    name: str
    title: str
    config_class: Callable[[], type]
    tools: Callable[[], Tools]
    variants: Mapping[str, Mapping[str, object]]
    needs_objects: Callable[[Any], bool]
    training_s: Callable[[Any, int, int], float]
    given: Callable[[Mapping[str, Any]], str | None]
    reduced: Callable[[JointPredictor, int, int], JointPredictor] | None = None


def _oarf_config() -> type:
    from forests.oarf.config import OARFConfig

    return OARFConfig


def _oarf_tools() -> Tools:
    from forests.oarf.forest import train
    from forests.oarf.predict import Predictor
    from forests.oarf.storage import load_model, pack_tree, save_model, unpack_tree

    return Tools(train, save_model, lambda path: Predictor(load_model(path)), Predictor, pack_tree, unpack_tree)


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
    from forests.rwf.forest import Walker as Predictor
    from forests.rwf.storage import load_model, pack_tree, save_model, unpack_tree
    from forests.rwf.train import train_rwf as train

    def unpack(arrays: dict[str, np.ndarray], _: LabelTable, config: Any) -> Any:
        return unpack_tree(arrays, config.n_clusters)

    return Tools(train, save_model, lambda path: Predictor(load_model(path)), Predictor, pack_tree, unpack)


def _rwf_training_s(config: Any, n_train: int, n_val: int) -> float:
    """7 us a point, tree and joint; 120 ms a frame to tune on, in one thread."""
    n_joints = len(config.joints) or len(config.skeleton)
    return 0.12 * n_val + 7e-6 * n_joints * config.n_trees * config.n_points * n_train


def _rwf_given(settings: Mapping[str, Any]) -> str:
    names = ", ".join(name.replace("_", " ") for name in settings["box_joints"])
    return (
        "Random walk forests are given the box around the true places of some joints, as by a perfect detector "
        f"({names}); the regression forests are given nothing but the image."
    )


KINDS: Mapping[str, ModelKind] = {
    kind.name: kind
    for kind in (
        ModelKind(
            name="oarf",
            title="regression forest",
            config_class=_oarf_config,
            tools=_oarf_tools,
            variants={mode: {"mode": mode} for mode in ("baseline", "occluders", "semantic")},
            needs_objects=lambda config: config.mode != "baseline",
            training_s=_oarf_training_s,
            given=lambda settings: None,
            reduced=_oarf_reduced,
        ),
        ModelKind(
            name="rwf",
            title="random walk forest",
            config_class=_rwf_config,
            tools=_rwf_tools,
            variants={"rwf_body": {"layer": "body"}, "rwf": {"layer": "composite"}},
            needs_objects=lambda config: False,
            training_s=_rwf_training_s,
            given=_rwf_given,
        ),
    )
}
"""All kinds by name."""

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
