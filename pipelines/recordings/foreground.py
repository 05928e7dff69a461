"""The person's pixels: cut out by a box and a depth range, stray blobs dropped."""

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.recordings.layout import Box


def cut_out(depth: NDArray[np.uint16], box: Box) -> NDArray[np.uint16]:
    """(height, width) uint16 [mm], 0 outside of the box."""
    far = box.far * 1000.0 if box.far else np.inf
    kept = np.where((depth >= box.near * 1000.0) & (depth <= far), depth, 0).astype(np.uint16)
    if not box.pixels:
        return kept
    left, top, right, bottom = box.pixels
    out = np.zeros_like(kept)
    out[top:bottom, left:right] = kept[top:bottom, left:right]
    return out


def drop_blobs(depth: NDArray[np.uint16], smallest_share: float) -> NDArray[np.uint16]:
    """The image without those connected regions that hold a smaller share of its pixels.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing; pixels touch across edges and corners.
        smallest_share: 0 keeps everything.
    """
    n_labels, regions = cv2.connectedComponents((depth > 0).view(np.uint8), connectivity=8)
    if n_labels < 3 or smallest_share <= 0.0:
        return depth
    n_pixels = np.bincount(regions.ravel())
    n_pixels[0] = 0
    is_kept = n_pixels >= smallest_share * n_pixels.sum()
    return np.where(is_kept[regions], depth, 0).astype(np.uint16)
