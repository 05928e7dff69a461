"""Pinhole cameras: intrinsics, projection, presets of depth sensors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

MAX_SIDE = 8192
"""Of an image [px]."""
MAX_PIXELS = 10**6
"""Of focal lengths and principal points [px]."""


@dataclass(frozen=True)
class Camera:
    """Pinhole intrinsics in OpenCV axes (x right, y down, z forward).

    Pixel centres lie at integer coordinates: ``u = fx * X / Z + cx``.

    Attributes:
        width: Image width in pixels.
        height: Image height in pixels.
        fx: Focal length along u in pixels.
        fy: Focal length along v in pixels.
        cx: Principal point u in pixels.
        cy: Principal point v in pixels.
        name: Preset's name, or "custom".
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    name: str = "custom"

    def __post_init__(self) -> None:
        if not (1 <= self.width <= MAX_SIDE and 1 <= self.height <= MAX_SIDE):
            raise ValueError(f"camera size {self.width}x{self.height} must be in 1..{MAX_SIDE} pixels a side")
        if not (0 < self.fx <= MAX_PIXELS and 0 < self.fy <= MAX_PIXELS):
            raise ValueError(
                f"focal lengths fx={self.fx}, fy={self.fy} must be positive and at most {MAX_PIXELS} px"
            )
        if not (abs(self.cx) <= MAX_PIXELS and abs(self.cy) <= MAX_PIXELS):
            raise ValueError(f"principal point cx={self.cx}, cy={self.cy} must be within {MAX_PIXELS} px")

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Projects camera-frame points to pixels.

        Args:
            points: (..., 3) camera frame [m], z > 0.

        Returns:
            (..., 2) float64 pixel coordinates (u, v).
        """
        xyz = np.asarray(points, dtype=np.float64)
        u = self.fx * xyz[..., 0] / xyz[..., 2] + self.cx
        v = self.fy * xyz[..., 1] / xyz[..., 2] + self.cy
        return np.stack([u, v], axis=-1)

    def backproject(self, pixels: ArrayLike, depth: ArrayLike) -> NDArray[np.float64]:
        """Lifts pixels with their depth into the camera frame.

        Args:
            pixels: (..., 2) pixel coordinates (u, v).
            depth: (...) z along the optical axis [m].

        Returns:
            (..., 3) float64, camera frame [m].
        """
        uv = np.asarray(pixels, dtype=np.float64)
        z = np.asarray(depth, dtype=np.float64)
        x = (uv[..., 0] - self.cx) * z / self.fx
        y = (uv[..., 1] - self.cy) * z / self.fy
        return np.stack([x, y, z], axis=-1)
