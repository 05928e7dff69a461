"""Sensor models by name: what a real depth camera would have made of a clean depth image.

A model is applied on reading a frame; the caller makes the generator from the corpus seed and the frame's index.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera


class SensorModel(Protocol):
    """A frozen set of parameters that turns clean depth into measured depth."""

    def measure(
        self, depth_mm: NDArray[np.uint16], camera: Camera, rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """Measures one image.

        Args:
            depth_mm: (height, width) uint16, clean z-depth [mm], 0 = no return.
            camera: The camera that the image was made with.
            rng: Source of all randomness; the same state gives the same bytes.

        Returns:
            (height, width) uint16, measured z-depth [mm], 0 = no return; a new array.
        """
        ...


class Ideal:
    """A sensor without any error."""

    def measure(
        self, depth_mm: NDArray[np.uint16], camera: Camera, rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """Returns a copy; draws nothing."""
        return depth_mm.copy()


class RandomSensor:
    """Another of the known sensors for every image, all alike frequent, "ideal" among them.

    For training: who learns from it is asked about any camera.
    """

    def measure(
        self, depth_mm: NDArray[np.uint16], camera: Camera, rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """Draws a sensor and measures with it; see `SensorModel`."""
        kinds = [name for name in SENSOR_NAMES if name != RANDOM]
        return sensor(kinds[int(rng.integers(len(kinds)))]).measure(depth_mm, camera, rng)


def _structured_light() -> SensorModel:
    from synth.render.sensors.structured_light import StructuredLight

    return StructuredLight()


def _time_of_flight() -> SensorModel:
    from synth.render.sensors.time_of_flight import TimeOfFlight

    return TimeOfFlight()


def _active_stereo() -> SensorModel:
    from synth.render.sensors.stereo import ActiveStereo

    return ActiveStereo()


RANDOM = "random"
"""Name of the sensor that is another one for every image."""
# The models load numba, which those who only want the names need not wait for.
_MAKERS: dict[str, Callable[[], SensorModel]] = {
    "ideal": Ideal,
    "kinect_v1": _structured_light,
    "kinect_v2": _time_of_flight,
    "realsense_d435": _active_stereo,
    RANDOM: RandomSensor,
}
SENSOR_NAMES: tuple[str, ...] = tuple(_MAKERS)
"""Known sensors; "ideal" is first, "random" last."""


def sensor(name: str) -> SensorModel:
    """Looks a sensor up.

    Args:
        name: One of `SENSOR_NAMES`.

    Returns:
        The model with its published parameters.

    Raises:
        ValueError: The name is unknown; the message lists the known ones.
    """
    if name not in _MAKERS:
        raise ValueError(f"sensor {name!r} is unknown; known sensors: {', '.join(SENSOR_NAMES)}")
    return _MAKERS[name]()


def apply_sensor(
    model: str | SensorModel, depth_mm: NDArray[Any], camera: Camera, rng: np.random.Generator
) -> NDArray[np.uint16]:
    """Measures a clean depth image with a sensor.

    Args:
        model: A name of `SENSOR_NAMES`, or a model with parameters of one's own.
        depth_mm: (height, width) uint16, clean z-depth [mm], 0 = no return. Left unchanged.
        camera: The camera that the image was made with.
        rng: Source of all randomness; the same state gives the same bytes.

    Returns:
        (height, width) uint16, measured z-depth [mm], 0 = no return; a new array.

    Raises:
        TypeError: The depth is not uint16.
        ValueError: The sensor is unknown, or the image has not the camera's size.
    """
    chosen = sensor(model) if isinstance(model, str) else model
    depth = np.asarray(depth_mm)
    if depth.dtype != np.uint16:
        raise TypeError(f"depth has dtype {depth.dtype}; sensors take uint16 millimetres, 0 = no return")
    if depth.shape != (camera.height, camera.width):
        raise ValueError(
            f"depth has shape {depth.shape}; camera {camera.name!r} makes ({camera.height}, {camera.width})"
        )
    return chosen.measure(np.ascontiguousarray(depth), camera, rng)
