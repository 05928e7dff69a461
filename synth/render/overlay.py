"""Rendered objects laid over the recorded depth of a person: per pixel, the nearer one is seen."""

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.render.records import RenderedPair
from synth.render.sensors import apply_sensor


def lay_over(body_depth: NDArray[np.uint16], body_part: NDArray[np.uint8], objects: RenderedPair) -> RenderedPair:
    """The two layers of a scene whose person was recorded; where both are equally far, the object is seen.

    Args:
        body_depth: (height, width) uint16 the recorded person [mm], 0 = nothing.
        body_part: (height, width) uint8 parts of the person.
        objects: A scene of objects without a person.

    Returns:
        The pair; its body layer is the recorded one.

    Raises:
        ValueError: The images are of another size than the rendered ones.
    """
    for name, image in (("body_depth", body_depth), ("body_part", body_part)):
        if image.shape != objects.depth.shape:
            raise ValueError(f"{name} has shape {image.shape}, the objects' images {objects.depth.shape}")
    is_seen = (objects.depth > 0) & ((body_depth == 0) | (objects.depth <= body_depth))
    return RenderedPair(
        depth=np.where(is_seen, objects.depth, body_depth),
        part=np.where(is_seen, 0, body_part).astype(np.uint8),
        occluder=np.where(is_seen, objects.occluder, 0).astype(np.uint8),
        instance=np.where(is_seen, objects.instance, 0).astype(np.uint8),
        body_depth=body_depth,
        body_part=body_part,
        object_pixels=objects.object_pixels,
    )


def as_measured(
    objects: RenderedPair, body_depth: NDArray[np.uint16], sensor: str, camera: Camera, rng: np.random.Generator
) -> RenderedPair:
    """A scene of objects as a sensor measures it.

    Pixels without return show nothing, but before the person they keep their clean depth: a sensor that loses an
    object does not see what is behind it. Labels stay where they are, so what the sensor spreads over the objects'
    outlines is left out.

    Args:
        objects: A scene of objects without a person.
        body_depth: (height, width) uint16 the recorded person [mm], 0 = nothing.
        sensor: Name of a sensor model.
        camera: The camera.
        rng: Source of the noise.
    """
    measured = apply_sensor(sensor, objects.depth, camera, rng)
    is_kept = (objects.depth > 0) & ((measured > 0) | (body_depth > 0))
    depth = np.where(measured > 0, measured, objects.depth)
    return RenderedPair(
        depth=np.where(is_kept, depth, 0).astype(np.uint16),
        part=objects.part,
        occluder=np.where(is_kept, objects.occluder, 0).astype(np.uint8),
        instance=np.where(is_kept, objects.instance, 0).astype(np.uint8),
        body_depth=objects.body_depth,
        body_part=objects.body_part,
        object_pixels=objects.object_pixels,
    )
