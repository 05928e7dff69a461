"""RealSense D435: stereo of two infrared imagers 5 cm apart, with a pattern projector; depth in the left one."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.camera import Camera
from synth.render.sensors.geometry import (
    disparity_of,
    drop_unsupported,
    hidden_from_right,
    incidence_cosine,
    is_grazing,
    smooth_noise,
)


@dataclass(frozen=True)
class ActiveStereo:
    """Parameters of the RealSense D435; pixels are those of the camera in use, as the device matches at that size.

    Attributes:
        baseline: Between the imagers [m] (D400 data sheet: 50 mm).
        subpixel: RMS error of the disparity [px]. sigma_z = z^2 subpixel / (f b): Keselman et al. 2017,
            eq. (2); Grunnet-Jepsen, Sweetser, Woodfill, "Tuning depth cameras for best performance" (Intel), depth
            RMS error; 0.08 px is a usual value for a well-textured target.
        steps: Disparity steps a pixel, 32 (Grunnet-Jepsen et al., "Subpixel linearity improvement" (Intel)).
        n_disparities: Search range [px]; the least depth is f b / n_disparities (D400 data sheet, 126).
        correlation: Smoothing of the disparity noise [px], the matching window's.
        fattening: (mean, spread) of the reach by which foreground grows over its edges [px]: half the window wins
            the vote there.
        window: Radius of the matching window [px].
        n_support: Samples of a ring of twelve in the window that must lie on the pixel's surface.
        graze: (mean, spread) of the angle of incidence where returns end [rad].
        max_depth: Largest depth with a return [m].
        edge: Relative step of depth that counts as an edge.
    """

    baseline: float = 0.050
    subpixel: float = 0.08
    steps: float = 32.0
    n_disparities: float = 126.0
    correlation: float = 2.0
    fattening: tuple[float, float] = (1.2, 0.8)
    window: float = 3.0
    n_support: int = 4
    graze: tuple[float, float] = (math.radians(80.0), math.radians(3.0))
    max_depth: float = 10.0
    edge: float = 0.03

    def measure(
        self, depth_mm: NDArray[np.uint16], camera: Camera, rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """Measures one image; see `synth.render.sensors.models.SensorModel`."""
        view = self._through(camera)
        noise = smooth_noise(rng, depth_mm.shape, self.correlation)
        reach = smooth_noise(rng, depth_mm.shape, self.correlation)
        disparity = disparity_of(depth_mm, view.scale)
        seen = disparity.copy()
        seen[hidden_from_right(disparity, is_left_border_hidden=True)] = 0.0
        cosine = incidence_cosine(disparity, camera)
        seen = _fatten(seen, disparity, cosine, reach, view)
        seen = drop_unsupported(seen, self.window, self.edge, self.n_support)
        return _quantize(seen, noise, view)

    def _through(self, camera: Camera) -> "_View":
        return _View(
            scale=self.baseline * camera.fx,
            subpixel=self.subpixel,
            steps=self.steps,
            n_disparities=self.n_disparities,
            max_depth=self.max_depth,
            fattening=self.fattening,
            edge=self.edge,
            graze=self.graze,
        )


class _View(NamedTuple):
    """The parameters as the kernels need them; `scale` times inverse depth [1/m] gives disparity [px]."""

    scale: float
    subpixel: float
    steps: float
    n_disparities: float
    max_depth: float
    fattening: tuple[float, float]
    edge: float
    graze: tuple[float, float]


@njit(cache=True, nogil=True)
def _fatten(
    matched: NDArray[np.float32],
    disparity: NDArray[np.float32],
    cosine: NDArray[np.float32],
    reach: NDArray[np.float32],
    view: _View,
) -> NDArray[np.float32]:
    """Lets near surfaces grow over what lies behind them, and drops grazing pixels.

    `matched` is the disparity without the hidden pixels.
    """
    height, width = disparity.shape
    seen = np.empty_like(matched)
    for v in range(height):
        for u in range(width):
            value = matched[v, u]
            if is_grazing(cosine[v, u], view.graze[0], view.graze[1], reach[v, u]):
                value = np.float32(0.0)
            limit = disparity[v, u] * (1.0 + view.edge)
            r = math.floor(view.fattening[0] + view.fattening[1] * reach[v, u] + 0.5)
            if r > 0:
                for dv, du in ((0, -r), (0, r), (-r, 0), (r, 0)):
                    y = v + dv
                    x = u + du
                    if 0 <= y < height and 0 <= x < width and matched[y, x] > limit:
                        value = max(value, matched[y, x])
            seen[v, u] = value
    return seen


@njit(cache=True, nogil=True)
def _quantize(seen: NDArray[np.float32], noise: NDArray[np.float32], view: _View) -> NDArray[np.uint16]:
    """Adds disparity noise, rounds to the device's steps, and goes back to millimetres."""
    height, width = seen.shape
    out = np.zeros((height, width), np.uint16)
    # The published RMS holds the rounding's own variance, a twelfth of a squared step.
    free = math.sqrt(max(view.subpixel**2 - 1.0 / (12.0 * view.steps**2), 0.0))
    for v in range(height):
        for u in range(width):
            if seen[v, u] <= 0.0:
                continue
            raw = math.floor(view.steps * (seen[v, u] + free * noise[v, u]) + 0.5)
            if raw <= 0 or raw > view.steps * view.n_disparities:
                continue
            measured = view.steps * view.scale / raw
            if measured <= view.max_depth:
                out[v, u] = np.uint16(1000.0 * measured + 0.5)
    return out
