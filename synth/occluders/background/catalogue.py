"""Every generator of what belongs to rooms, by its kind; beside `synth.occluders.registry`, whose classes they lack."""

from collections.abc import Mapping

import numpy as np

from synth.occluders import registry
from synth.occluders.background import hanging, shelf, standing
from synth.occluders.kit.spec import Spec
from synth.occluders.model import Occluder
from synth.occluders.registry import Generator

CLASS_NAME = "background"
_GENERATORS = (
    Generator("shelf", CLASS_NAME, shelf.ShelfSpec, shelf.sample_shelf, shelf.make_shelf),
    Generator("cabinet", CLASS_NAME, shelf.CabinetSpec, shelf.sample_cabinet, shelf.make_cabinet),
    Generator("curtain", CLASS_NAME, hanging.CurtainSpec, hanging.sample_curtain, hanging.make_curtain),
    Generator("radiator", CLASS_NAME, hanging.RadiatorSpec, hanging.sample_radiator, hanging.make_radiator),
    Generator("panel", CLASS_NAME, hanging.PanelSpec, hanging.sample_panel, hanging.make_panel),
    Generator("pillar", CLASS_NAME, standing.PillarSpec, standing.sample_pillar, standing.make_pillar),
    Generator(
        "coat_stand", CLASS_NAME, standing.CoatStandSpec, standing.sample_coat_stand, standing.make_coat_stand
    ),
    Generator(
        "floor_lamp", CLASS_NAME, standing.FloorLampSpec, standing.sample_floor_lamp, standing.make_floor_lamp
    ),
    Generator("plant", CLASS_NAME, standing.PlantSpec, standing.sample_plant, standing.make_plant),
)
FIXTURES: dict[str, Generator] = {generator.kind: generator for generator in _GENERATORS}
"""Generators by kind."""
_KIND_OF: dict[type[Spec], str] = {generator.spec_type: generator.kind for generator in _GENERATORS}


def sample(kind: str, rng: np.random.Generator) -> Spec:
    """Draws a spec of a kind of the room's own things, or of a kind of the registry."""
    drawn: Spec = (FIXTURES.get(kind) or registry.generator(kind)).sample(rng)
    return drawn


def make(spec: Spec) -> Occluder:
    """Builds what a spec describes, of either table."""
    kind = _KIND_OF.get(type(spec))
    return registry.make(spec) if kind is None else FIXTURES[kind].make(spec)


def to_plain(spec: Spec) -> dict[str, object]:
    """A spec of either table as plain JSON values: "kind" and its fields."""
    kind = _KIND_OF.get(type(spec))
    return registry.to_plain(spec) if kind is None else {"kind": kind, **spec.to_plain()}


def from_plain(plain: Mapping[str, object]) -> Spec:
    """The inverse of `to_plain`.

    Raises:
        ValueError: The kind or a field is unknown or missing, or a value is not allowed.
    """
    kind = plain.get("kind")
    if not isinstance(kind, str) or kind not in FIXTURES:
        return registry.from_plain(plain)
    return FIXTURES[kind].spec_type.from_plain({name: value for name, value in plain.items() if name != "kind"})
