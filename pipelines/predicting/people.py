"""Everybody in an image of a whole scene: found, numbered from left to right, cut out one by one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forests.finder.cutting import cut_person
from forests.finder.find import Found, FoundPerson, PeopleFinder
from forests.finder.floor import Floor
from pipelines.errors import UserError
from pipelines.predicting.images import DepthImage, Request
from pipelines.predicting.skeleton import number_value
from pipelines.spread import first_to_last

FULL_SHARE = 0.5
"""An image with depth in at least this share of its pixels is taken for one of a whole scene: a person who is cut out
covers less, with all objects around, but in one of a hundred close-ups."""
N_LOOKED_AT = 9
"""So many images of a sequence are looked at for this, evenly spread; most of them decide for all."""


@dataclass(frozen=True)
class Somebody:
    """One of the people who were found in an image.

    Attributes:
        number: From left to right, from 0.
        person: What was found.
        floor: The floor that was found in the image; None if none was.
        depth: (height, width) uint16, the image without what is not about the person [mm].
    """

    number: int
    person: FoundPerson
    floor: Floor | None
    depth: NDArray[np.uint16]


def everybody(finder: PeopleFinder, image: DepthImage) -> tuple[Somebody, ...]:
    """The people in an image of a whole scene, from left to right."""
    found = finder.find(*image)
    order = sorted(found.people, key=lambda person: float(person.axis[0] / person.axis[2]))
    people = Found(tuple(order), found.floor)
    return tuple(
        Somebody(k, person, found.floor, cut_person(*image, people, k)) for k, person in enumerate(people)
    )


def share_with_depth(requests: Sequence[Request]) -> float:
    """Share of an image's pixels that have depth: the median of some images; 0 if none of them can be read."""
    shares = []
    for place in first_to_last(len(requests), N_LOOKED_AT).tolist():
        try:
            shares.append(float((requests[place].read().depth > 0).mean()))
        except (UserError, OSError):
            continue
    return float(np.median(shares)) if shares else 0.0


def found_values(somebody: Somebody) -> dict[str, Any]:
    """What the finder says of a person, as JSON values."""
    person, floor = somebody.person, somebody.floor
    return {
        "number": somebody.number,
        "confidence": number_value(person.confidence),
        "distance": number_value(person.distance),
        "box": [number_value(edge) for edge in person.box],
        "upper_body": [number_value(edge) for edge in person.upper_body],
        "axis": [number_value(value) for value in person.axis],
        "place": [number_value(value) for value in person.place[:2]],
        "height": number_value(person.height),
        "floor": None
        if floor is None
        else {"normal": [number_value(value) for value in floor.normal], "height": number_value(floor.height)},
    }
