"""Kinect v1: structured light, triangulated between an infrared camera and a projector 7.5 cm to its right."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.camera import Camera
from synth.render.sensors.geometry import (
    bend,
    bridge_pinholes,
    disparity_of,
    drop_unsupported,
    fill_gaps,
    hidden_from_right,
    incidence_cosine,
    is_grazing,
    smooth_noise,
)


@dataclass(frozen=True)
class StructuredLight:
    """Parameters of the Kinect v1.

    "Native" pixels are those of the device's 640x480 stream; other cameras are taken for a resampled view of it.

    Attributes:
        baseline: Camera to projector [m]. 7.5 cm: Konolige and Mihelich, "Technical description of Kinect
            calibration" (ROS wiki kinect_calibration/technical); libfreenect's dcmos_emitter_distance.
        native_focal: Focal length of the 640x480 stream [px]: half of zero plane distance 120 cm over its pixel
            size 0.1042 cm (libfreenect, freenect_zero_plane_info).
        steps: Disparity steps a native pixel: 1/8 px (Konolige and Mihelich, d = (doff - kd) / 8).
        offset: doff of the same equation [steps]. 1089.408 follows from libfreenect's table
            (z = 120 cm b / (b - m), m = ((kd - 800) / 4 - 0.375) 0.1042 cm).
        axial: (c0 [m], c1 [1/m], c2 [m]) of sigma_z = c0 + c1 (z - c2)^2, Nguyen, Izadi, Lovell 2012, section 2.
        axial_angle: c3 of the addend c3 / sqrt(z) theta^2 / (pi/2 - theta)^2 [m^1.5], ibid.
        lateral: (c0, c1) [native px] of sigma_L = c0 + c1 theta / (pi/2 - theta), ibid.
        axial_correlation: Smoothing of the axial noise [native px]; fitted to real frames (docs/sensors.md).
        lateral_correlation: Smoothing of the wobble of edges [native px].
        window: Radius of the matching window [native px].
        n_support: Samples of a ring of twelve in the window that must lie on the pixel's surface.
        n_filled: Samples of that ring that must lie on a nearer surface for it to win the pixel, as between fingers.
        n_bridged: Rounds in which pixels without a return get one from their neighbours, if at least six of the
            eight have one: the window is larger than such a hole.
        graze: (mean, spread) of the angle of incidence where returns end [rad].
        depth_range: Depths with a return [m].
        edge: Relative step of depth that counts as an edge.
    """

    baseline: float = 0.075
    native_focal: float = 0.5 * 120.0 / 0.1042
    steps: float = 8.0
    offset: float = 800.0 + 4.0 * (7.5 / 0.1042 + 0.375)
    axial: tuple[float, float, float] = (0.0012, 0.0019, 0.4)
    axial_angle: float = 0.0001
    lateral: tuple[float, float] = (0.8, 0.035)
    axial_correlation: float = 6.5
    lateral_correlation: float = 2.5
    window: float = 4.0
    n_support: int = 4
    n_filled: int = 8
    n_bridged: int = 2
    graze: tuple[float, float] = (math.radians(80.0), math.radians(3.0))
    depth_range: tuple[float, float] = (0.5, 8.0)
    edge: float = 0.03

    def measure(
        self, depth_mm: NDArray[np.uint16], camera: Camera, rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """Measures one image; see `synth.render.sensors.models.SensorModel`."""
        view = self._through(camera)
        shape = depth_mm.shape
        scale = camera.fx / self.native_focal
        wobble_u = smooth_noise(rng, shape, self.lateral_correlation * scale)
        wobble_v = smooth_noise(rng, shape, self.lateral_correlation * scale)
        noise = smooth_noise(rng, shape, self.axial_correlation * scale)
        disparity = disparity_of(depth_mm, view.scale)
        cosine = incidence_cosine(disparity, camera)
        lit = disparity.copy()
        lit[hidden_from_right(disparity, is_left_border_hidden=False)] = 0.0
        _drop_grazing(lit, cosine, wobble_u, view)
        lean = _bend_of(cosine)
        seen = _wobble(lit, lean, (wobble_u, wobble_v), view)
        seen = fill_gaps(seen, self.window * scale, self.edge, self.n_filled)
        seen = drop_unsupported(seen, self.window * scale, self.edge, self.n_support)
        for _ in range(self.n_bridged):
            seen = bridge_pinholes(seen)
        return _quantize(seen, lean, noise, view)

    def _through(self, camera: Camera) -> "_View":
        scale = camera.fx / self.native_focal
        return _View(
            scale=self.baseline * camera.fx,
            steps=self.steps * self.baseline * self.native_focal,
            offset=self.offset,
            lateral=(self.lateral[0] * scale, self.lateral[1] * scale),
            axial=self.axial,
            axial_angle=self.axial_angle,
            edge=self.edge,
            graze=self.graze,
            depth_range=self.depth_range,
        )


class _View(NamedTuple):
    """The parameters as the kernels need them, in pixels of one camera.

    `scale` and `steps` times inverse depth [1/m] give disparity in the camera's pixels and in the device's steps.
    """

    scale: float
    steps: float
    offset: float
    lateral: tuple[float, float]
    axial: tuple[float, float, float]
    axial_angle: float
    edge: float
    graze: tuple[float, float]
    depth_range: tuple[float, float]


@njit(cache=True, nogil=True)
def _drop_grazing(
    lit: NDArray[np.float32], cosine: NDArray[np.float32], noise: NDArray[np.float32], view: _View
) -> None:
    """Zeroes, in place, what is seen at too flat an angle."""
    for v in range(lit.shape[0]):
        for u in range(lit.shape[1]):
            if is_grazing(cosine[v, u], view.graze[0], view.graze[1], noise[v, u]):
                lit[v, u] = 0.0


@njit(cache=True, nogil=True)
def _bend_of(cosine: NDArray[np.float32]) -> NDArray[np.float32]:
    out = np.empty_like(cosine)
    for v in range(cosine.shape[0]):
        for u in range(cosine.shape[1]):
            out[v, u] = bend(cosine[v, u])
    return out


@njit(cache=True, nogil=True)
def _wobble(
    lit: NDArray[np.float32],
    lean: NDArray[np.float32],
    wobble: tuple[NDArray[np.float32], NDArray[np.float32]],
    view: _View,
) -> NDArray[np.float32]:
    """Moves edges sideways by the lateral noise.

    Within one surface nothing moves: its depth noise is the axial one, which was measured with it.
    """
    height, width = lit.shape
    seen = np.empty_like(lit)
    for v in range(height):
        for u in range(width):
            # Nguyen et al. 2012, section 2: lateral noise [px]
            sigma = view.lateral[0] + view.lateral[1] * lean[v, u]
            x = min(max(math.floor(u + sigma * wobble[0][v, u] + 0.5), 0), width - 1)
            y = min(max(math.floor(v + sigma * wobble[1][v, u] + 0.5), 0), height - 1)
            here = lit[v, u]
            there = lit[y, x]
            seen[v, u] = there if abs(there - here) > view.edge * max(here, there) else here
    return seen


@njit(cache=True, nogil=True)
def _quantize(
    seen: NDArray[np.float32], lean: NDArray[np.float32], noise: NDArray[np.float32], view: _View
) -> NDArray[np.uint16]:
    """Adds axial noise in disparity, rounds to the device's steps, and goes back to millimetres."""
    height, width = seen.shape
    out = np.zeros((height, width), np.uint16)
    for v in range(height):
        for u in range(width):
            if seen[v, u] <= 0.0:
                continue
            z = view.scale / seen[v, u]
            if not view.depth_range[0] <= z <= view.depth_range[1]:
                continue
            sigma_z = (
                view.axial[0] + view.axial[1] * (z - view.axial[2]) ** 2
            )  # Nguyen et al. 2012, section 2: axial noise [m]
            sigma_z += view.axial_angle / math.sqrt(z) * lean[v, u] ** 2  # its addend for tilt
            # sigma_z = z^2 / (f b) sigma_d (Khoshelham and Elberink 2012, random error). The published sigma_z
            # holds the rounding's own variance, a twelfth of a squared step.
            sigma_d = sigma_z * view.steps / (z * z)
            free = math.sqrt(max(sigma_d * sigma_d - 1.0 / 12.0, 0.0))
            raw = math.floor(view.offset - view.steps / z + free * noise[v, u] + 0.5)
            if raw >= view.offset:
                continue
            measured = view.steps / (view.offset - raw)
            if view.depth_range[0] <= measured <= view.depth_range[1]:
                out[v, u] = np.uint16(1000.0 * measured)  # drivers cut the fraction off
    return out
