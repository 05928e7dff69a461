"""Every generator of occluders by its kind, and specs as plain JSON values."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.occluders.furniture import chair, desk, laptop, monitor, office_chair, other, sofa, suitcase, table
from synth.occluders.kit.linkage import Linkage
from synth.occluders.kit.spec import Spec
from synth.occluders.model import Occluder
from synth.occluders.stroller import pram, three_wheeler, umbrella


@dataclass(frozen=True)
class Generator:
    """One kind of object.

    Attributes:
        kind: Its name, stored with its specs.
        class_name: Its class in `OCCLUDER_CLASSES`.
        spec_type: Its parameters.
        sample: Draws a spec.
        make: Builds an object from a spec; no randomness.
        weight: How often `sample` takes it among the kinds of its class; at 0 only when asked for.
        linkage: Its links and joints if it is articulated.
    """

    kind: str
    class_name: str
    spec_type: type[Spec]
    sample: Callable[[np.random.Generator], Any]
    make: Callable[[Any], Occluder]
    weight: float = 1.0
    linkage: Callable[[Any], Linkage] | None = None


_GENERATORS = (
    Generator("table", "table", table.TableSpec, table.sample_table, table.make_table, 3.0),
    Generator("desk", "table", desk.DeskSpec, desk.sample_desk, desk.make_desk),
    Generator("coffee_table", "table", table.CoffeeTableSpec, table.sample_coffee_table, table.make_table, 0.0),
    Generator(
        "laptop",
        "laptop",
        laptop.LaptopSpec,
        laptop.sample_laptop,
        laptop.make_laptop,
        linkage=laptop.laptop_linkage,
    ),
    Generator(
        "umbrella_stroller",
        "stroller",
        umbrella.UmbrellaStrollerSpec,
        umbrella.sample_umbrella,
        umbrella.make_umbrella,
        linkage=umbrella.umbrella_linkage,
    ),
    Generator("pram", "stroller", pram.PramSpec, pram.sample_pram, pram.make_pram, linkage=pram.pram_linkage),
    Generator(
        "three_wheeler",
        "stroller",
        three_wheeler.ThreeWheelerSpec,
        three_wheeler.sample_three_wheeler,
        three_wheeler.make_three_wheeler,
        linkage=three_wheeler.three_wheeler_linkage,
    ),
    Generator(
        "dining_chair", "chair", chair.DiningChairSpec, chair.sample_dining_chair, chair.make_dining_chair, 2.0
    ),
    Generator(
        "office_chair",
        "chair",
        office_chair.OfficeChairSpec,
        office_chair.sample_office_chair,
        office_chair.make_office_chair,
        linkage=office_chair.office_chair_linkage,
    ),
    Generator(
        "folding_chair",
        "chair",
        chair.FoldingChairSpec,
        chair.sample_folding_chair,
        chair.make_folding_chair,
        0.6,
    ),
    Generator("stool", "chair", chair.StoolSpec, chair.sample_stool, chair.make_stool, 0.7),
    Generator("sofa", "chair", sofa.SofaSpec, sofa.sample_sofa, sofa.make_sofa),
    Generator("monitor", "monitor", monitor.MonitorSpec, monitor.sample_monitor, monitor.make_monitor),
    Generator("suitcase", "suitcase", suitcase.SuitcaseSpec, suitcase.sample_suitcase, suitcase.make_suitcase),
    Generator("boxes", "other", other.BoxesSpec, other.sample_boxes, other.make_boxes),
    Generator("bin", "other", other.BinSpec, other.sample_bin, other.make_bin, 0.5),
)

GENERATORS: dict[str, Generator] = {generator.kind: generator for generator in _GENERATORS}
"""Generators by kind."""
KINDS: dict[str, tuple[str, ...]] = {
    name: tuple(g.kind for g in _GENERATORS if g.class_name == name)
    for name in dict.fromkeys(g.class_name for g in _GENERATORS)
}
"""Kinds of each class."""
_KIND_OF: dict[type[Spec], str] = {g.spec_type: g.kind for g in _GENERATORS}


def generator(kind: object) -> Generator:
    """The generator of a kind.

    Raises:
        ValueError: No such kind; the message lists the known ones.
    """
    if not isinstance(kind, str) or kind not in GENERATORS:
        raise ValueError(f"unknown kind of object {kind!r}, known are {', '.join(GENERATORS)}")
    return GENERATORS[kind]


def kind_of(spec: Spec) -> str:
    """The kind that a spec belongs to."""
    return _KIND_OF[type(spec)]


def sample(class_name: str, rng: np.random.Generator, **constraints: object) -> Spec:
    """Draws a spec of a class.

    Args:
        class_name: "table", "laptop", "stroller", "chair", "monitor", "suitcase" or "other".
        rng: Source of randomness.
        **constraints: `kind` fixes the kind; any other name fixes that field of the spec.

    Raises:
        ValueError: Unknown class, kind or field, or a value that is not allowed.
    """
    if class_name not in KINDS:
        raise ValueError(f"unknown occluder class {class_name!r}, known are {', '.join(KINDS)}")
    kind = constraints.pop("kind", None)
    if kind is None:
        kinds = KINDS[class_name]
        weights = np.array([GENERATORS[k].weight for k in kinds])
        kind = kinds[int(rng.choice(len(kinds), p=weights / weights.sum()))]
    if kind not in KINDS[class_name]:
        raise ValueError(f"class {class_name!r} has no kind {kind!r}, only {', '.join(KINDS[class_name])}")
    chosen = generator(kind)
    chosen.spec_type.check_names(constraints)
    drawn: Spec = chosen.sample(rng)
    return replace(drawn, **constraints) if constraints else drawn


def make(spec: Spec) -> Occluder:
    """Builds the object that a spec describes."""
    return GENERATORS[kind_of(spec)].make(spec)


def to_plain(spec: Spec) -> dict[str, object]:
    """A spec as plain JSON values: "kind" and its fields."""
    return {"kind": kind_of(spec), **spec.to_plain()}


def from_plain(plain: Mapping[str, object]) -> Spec:
    """The inverse of `to_plain`.

    Raises:
        ValueError: The kind or a field is unknown or missing, or a value is not allowed.
    """
    chosen = generator(plain.get("kind"))
    return chosen.spec_type.from_plain({name: value for name, value in plain.items() if name != "kind"})
