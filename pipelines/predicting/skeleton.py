"""What was found in an image, as JSON values and as a picture; docs/formats.md describes the keys."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.frames import Pinhole
from pipelines.drawing.labels import PixelLabels
from pipelines.drawing.overlays import overlay
from pipelines.models.asking import Contestant

SCHEMA = "undergrowth skeleton"
SCHEMA_VERSION = 1


def joint_values(estimate: JointEstimate, joints: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """What was found, by joint, as JSON values.

    Args:
        estimate: The joints.
        joints: Their names.
    """
    values: dict[str, dict[str, Any]] = {}
    for k, name in enumerate(joints):
        is_there = np.isfinite(estimate.proposals[k]).all(axis=1)
        found = zip(estimate.proposals[k][is_there], estimate.proposal_confidence[k][is_there], strict=True)
        values[name] = {
            "xyz": place_value(estimate.joints[k]),
            "uv": place_value(estimate.joints_2d[k]),
            "confidence": number_value(estimate.confidence[k]),
            "probability": number_value(estimate.probability[k]),
            "hidden_probability": number_value(estimate.hidden_probability[k]),
            "outside_probability": number_value(estimate.outside_probability[k]),
            "self_hidden_probability": number_value(estimate.self_hidden_probability[k]),
            "spread": number_value(estimate.spread[k]),
            "proposals": [{"xyz": place_value(xyz), "confidence": number_value(share)} for xyz, share in found],
        }
    return values


def body_values(estimate: JointEstimate, joints: tuple[str, ...]) -> dict[str, Any]:
    """What was found of the person as JSON values, with the skeleton of the other heading if there is one."""
    values: dict[str, Any] = {
        "person_probability": number_value(estimate.person_probability),
        "heading": number_value(estimate.heading),
        "heading_probability": number_value(estimate.heading_probability),
        "joints": joint_values(estimate, joints),
        "alternative": None,
    }
    other = estimate.alternative
    if other is not None:
        values["alternative"] = {
            "heading": number_value(other.heading),
            "heading_probability": number_value(other.heading_probability),
            "joints": {name: place_value(place) for name, place in zip(joints, other.joints, strict=True)},
        }
    return values


def skeleton_picture(
    contestant: Contestant, depth: NDArray[np.uint16], camera: Pinhole, estimate: JointEstimate
) -> NDArray[np.uint8]:
    """The skeleton over the depth; beside it the labels of the pixels, if the model gives any."""
    if contestant.labeller is None:
        return overlay(depth, estimate, contestant.joints)
    labels = contestant.labeller.label_pixels(depth, camera)
    return overlay(depth, estimate, contestant.joints, PixelLabels(labels, contestant.labeller.classes))


def place_value(values: NDArray[np.float32]) -> list[float | None] | None:
    """A place as JSON has it; None if it is none."""
    return [number_value(value) for value in values] if np.isfinite(values).all() else None


def number_value(value: float) -> float | None:
    """Six digits; None for what is not finite, which JSON cannot say."""
    return float(f"{value:.6g}") if math.isfinite(value) else None
