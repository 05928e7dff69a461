"""Kinect v2: continuous-wave time of flight, lit from beside the lens."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.camera import Camera
from synth.render.sensors.geometry import bend, disparity_of, incidence_cosine


@dataclass(frozen=True)
class TimeOfFlight:
    """Parameters of the Kinect v2.

    Attributes:
        axial: (c0, c1, c2) of sigma_z = c0 + c1 z + c2 z^2 [mm; z in m], Fankhauser et al. 2015, axial noise.
        axial_angle: c3 of the addend c3 z^1.5 theta^2 / (pi/2 - theta)^2 [mm], ibid.
        edge: Relative step of depth at which a pixel's footprint may hold two surfaces.
        mixed_share: Share of the pixels beside an edge whose footprint does (flying pixels,
            Sarbolandi et al. 2015); the share is ours.
        kept_share: Share of the mixed pixels that pass the driver's edge filter (ours); the others read 0.
        reach: Depth at which a frontal white surface on the axis falls to the least usable amplitude [m].
        falloff: Power of the cosine of the ray's angle by which light and lens fall off to the corners.
        softness: Relative width of the step from return to none about the least amplitude.
        depth_range: Depths with a return [m]; the device reports 0.5 to 8 m, and is specified to 4.5 m.
    """

    axial: tuple[float, float, float] = (1.5, -0.5, 0.3)
    axial_angle: float = 0.1
    edge: float = 0.03
    mixed_share: float = 0.5
    kept_share: float = 0.5
    reach: float = 8.0
    falloff: float = 4.0
    softness: float = 0.1
    depth_range: tuple[float, float] = (0.5, 8.0)

    def measure(
        self, depth_mm: NDArray[np.uint16], camera: Camera, rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """Measures one image; see `synth.render.sensors.models.SensorModel`."""
        noise = rng.standard_normal(depth_mm.shape, dtype=np.float32)
        chance = rng.random(depth_mm.shape, dtype=np.float32)
        depth = depth_mm.astype(np.float32) * np.float32(0.001)
        cosine = incidence_cosine(disparity_of(depth_mm, 1.0), camera)
        return _measure(depth, cosine, noise, chance, self._through(camera))

    def _through(self, camera: Camera) -> "_View":
        u = (np.arange(camera.width) - camera.cx) / camera.fx
        v = (np.arange(camera.height) - camera.cy) / camera.fy
        return _View(
            axial=self.axial,
            axial_angle=self.axial_angle,
            edge=self.edge,
            mixed_share=self.mixed_share,
            kept_share=self.kept_share,
            light=((1.0 + u[None, :] ** 2 + v[:, None] ** 2) ** (-0.5 * self.falloff)).astype(np.float32),
            faintest=1.0 / self.reach**2,
            softness=self.softness,
            depth_range=self.depth_range,
        )


class _View(NamedTuple):
    """The parameters as the kernel needs them, for one camera.

    `light` (height, width) float32 is the share of the light that is left at each pixel, `faintest` the least
    amplitude that gives a return [1/m^2].
    """

    axial: tuple[float, float, float]
    axial_angle: float
    edge: float
    mixed_share: float
    kept_share: float
    light: NDArray[np.float32]
    faintest: float
    softness: float
    depth_range: tuple[float, float]


@njit(cache=True, nogil=True)
def _across_edge(depth: NDArray[np.float32], v: int, u: int, edge: float) -> tuple[int, int]:
    """The 4-neighbour whose depth differs most, or the pixel itself where none differs by the edge's step."""
    height, width = depth.shape
    z = depth[v, u]
    best = edge * z
    found = (v, u)
    for dv, du in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        y = v + dv
        x = u + du
        if 0 <= y < height and 0 <= x < width and depth[y, x] > 0.0 and abs(depth[y, x] - z) > best:
            best = abs(depth[y, x] - z)
            found = (y, x)
    return found


@njit(cache=True, nogil=True)
def _measure(
    depth: NDArray[np.float32],
    cosine: NDArray[np.float32],
    noise: NDArray[np.float32],
    chance: NDArray[np.float32],
    view: _View,
) -> NDArray[np.uint16]:
    height, width = depth.shape
    out = np.zeros((height, width), np.uint16)
    n_kept = view.mixed_share * view.kept_share
    for v in range(height):
        for u in range(width):
            z = float(depth[v, u])
            if z <= 0.0:
                continue
            amplitude = view.light[v, u] * cosine[v, u] / (z * z)
            draw = chance[v, u]
            y, x = _across_edge(depth, v, u, view.edge)
            if (y != v or x != u) and draw < view.mixed_share:
                if draw >= n_kept:
                    continue
                # Flying pixel: the light of both surfaces adds up in it (Sarbolandi et al. 2015). The neighbour's
                # share of its area is uniform in [0, 1/2].
                share = 0.5 * draw / n_kept
                behind = float(depth[y, x])
                other = share * view.light[y, x] * cosine[y, x] / (behind * behind)
                own = (1.0 - share) * amplitude
                z = (own * z + other * behind) / (own + other)
            if amplitude < view.faintest * (1.0 + view.softness * noise[v, u]):
                continue
            lean = bend(cosine[v, u])
            sigma = view.axial[0] + z * (view.axial[1] + view.axial[2] * z)  # Fankhauser et al. 2015 [mm]
            sigma += view.axial_angle * z * math.sqrt(z) * lean * lean
            measured = 1000.0 * z + sigma * noise[v, u]
            if 1000.0 * view.depth_range[0] <= measured <= 1000.0 * view.depth_range[1]:
                out[v, u] = np.uint16(measured + 0.5)
    return out
