"""Polygonises the mean body once and writes synth/bodies/data/template*.npz.

    pip install open3d
    python tools/make_template.py

Every subject's skin is this mesh laid over its own axes and radii (`synth.bodies.shape.laying.lay_skin`), so
that triangles, labels and weights are the same for all of them.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent))
from body_field import segment_distances, union
from mesh_smoothing import flipped, is_closed, largest_piece, mean_value_matrix, relaxed, softened, taubin
from surface_nets import mirrored, surface_nets, thinned
from template_rules import Landmarks, Membership, labels_of, smoothstep, unit, weights_of

from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.shape.clothes import skirt_table
from synth.bodies.shape.frame_points import BIND_ANGLES, bind_points, skeleton_of
from synth.bodies.shape.measures import mix_of, profiles
from synth.bodies.shape.segments import (
    FINGERS,
    LAYOUT,
    N_SEGMENTS,
    POINT_IDX,
    SEGMENT_IDX,
    Axes,
    axes_through,
    locate,
    radius_at,
)
from synth.bodies.shape.template import SKIRT_EASE, SKIRT_FLARE
from synth.bodies.skeleton import LINK_IDX, N_LINKS

OUT = Path(__file__).resolve().parents[1] / "synth" / "bodies" / "data"
STATURE = 1.68
HAS_SEAMS = np.zeros(N_SEGMENTS, dtype=bool)
HAS_SEAMS[
    [SEGMENT_IDX[n] for n in ("trunk", "neck", "clavicle", "upper_arm", "forearm", "palm", "thigh", "shank")]
] = True
N_HELD = 4
"""Segments that may hold one point."""


class MeanBody:
    """The body halfway between the average woman and man of 25 years.

    Args:
        hem: Where the skirt ends (0 hip, 1 knee, 2 ankle); None for no skirt.
    """

    def __init__(self, hem: float | None) -> None:
        has_skirt = hem is not None
        mix = mix_of(0.5, 25.0, 0.0, 0.0).base
        self.measures = mix @ profiles().lengths * STATURE
        self.skeleton = skeleton_of(self.measures)
        self.points = bind_points(self.skeleton, self.measures, STATURE, hem or 1.0)
        self.axes: Axes = axes_through(self.points)
        self.table = (mix @ profiles().radii * STATURE).astype(np.float32)
        self.has_skirt = has_skirt
        if has_skirt:
            skirt_table(self.table, self.axes, SKIRT_EASE, SKIRT_FLARE)
        self.mark = Landmarks(link_transforms(self.skeleton, BIND_ANGLES, np.eye(4)), STATURE)

    def point(self, name: str) -> NDArray[np.float64]:
        """(3,) an axis point."""
        return self.points[POINT_IDX[name]]

    def distances(self, p: NDArray[np.float64]) -> NDArray[np.float32]:
        """(n, n_segments) distances outside each segment."""
        out = np.empty((len(p), N_SEGMENTS), dtype=np.float32)
        segment_distances(np.ascontiguousarray(p), self.axes, LAYOUT, self.table, HAS_SEAMS, out)
        if not self.has_skirt:
            out[:, SEGMENT_IDX["skirt"]] = 9.0
        return out


def fine_half(body: MeanBody, step: float, n_faces: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The left half's surface, smoothed and thinned."""
    low = np.array(
        [body.points[:, 0].min() - (0.24 if body.has_skirt else 0.12), -0.5 * step, body.point("ankle")[2] - 0.11]
    )
    high = body.points.max(axis=0) + np.array([0.16, 0.06, 0.17])
    shape = np.ceil((high - low) / step).astype(int)
    field = np.empty(shape, dtype=np.float32)
    y, z = low[1] + step * np.arange(shape[1]), low[2] + step * np.arange(shape[2])
    for i in range(shape[0]):
        grid = np.stack(np.meshgrid([low[0] + step * i], y, z, indexing="ij"), axis=-1).reshape(-1, 3)
        field[i] = union(body.distances(grid), 0.010).reshape(shape[1:])
    vertices, faces = surface_nets(field, low, step)
    vertices, faces = largest_piece(vertices, faces)
    vertices = taubin(vertices, faces, 12)
    d = body.distances(vertices)
    seam = np.maximum(d[:, SEGMENT_IDX["trunk"]], d[:, SEGMENT_IDX["thigh"]])
    vertices = softened(vertices, faces, smoothstep(-seam, -0.022, -0.010), 40)
    vertices[:, 1] = np.maximum(vertices[:, 1], 0.0)
    fine = vertices, faces
    vertices, faces = thinned(vertices, faces, n_faces)
    for _ in range(3):
        faces = flipped(vertices, faces, 4)
        vertices = relaxed(vertices, faces, fine, 2)
    return vertices, faces


def coordinates(body: MeanBody, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> dict[str, NDArray]:
    """Which segments hold each vertex of the half, how much, and its coordinates in them."""
    d = body.distances(vertices).astype(np.float64)
    share = np.exp(-np.clip((d - d.min(axis=1, keepdims=True)) / 0.004, 0.0, 40.0))
    share /= share.sum(axis=1, keepdims=True)
    edges = vertices[faces] - vertices[np.roll(faces, 1, axis=1)]
    small = np.linalg.norm(edges, axis=2).max(axis=1) < 0.05
    mean = mean_value_matrix(vertices, faces[small])
    for _ in range(14):
        share = 0.4 * share + 0.6 * (mean @ share)
    held = np.argsort(-share, axis=1)[:, :N_HELD]
    kept = np.take_along_axis(share, held, axis=1)
    kept[kept < 0.02] = 0.0
    kept /= kept.sum(axis=1, keepdims=True)
    coords = np.zeros((*held.shape, 3))
    for v, k in np.argwhere(kept > 0):
        station, angle, r, _ = locate(body.axes, LAYOUT, held[v, k], *vertices[v])
        coords[v, k] = station, angle, r / max(radius_at(body.table, LAYOUT, held[v, k], station, angle), 0.002)
    held[kept == 0] = -1
    return {
        "segment": held.astype(np.int8),
        "share": kept.astype(np.float32),
        "coords": coords.astype(np.float32),
    }


def ring_weights(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> dict[str, NDArray]:
    """Neighbours of each vertex and their mean value weights as arrays."""
    total = mean_value_matrix(vertices, faces)
    return {
        "ring_start": total.indptr.astype(np.int32),
        "ring": total.indices.astype(np.int32),
        "ring_weight": total.data.astype(np.float32),
    }


def membership(body: MeanBody, p: NDArray[np.float64]) -> Membership:
    """Whose surface each point of the left half is."""
    d = body.distances(p).astype(np.float64)

    def nearest(*names: str) -> NDArray[np.float64]:
        return d[:, [SEGMENT_IDX[n] for n in names]].min(axis=1)

    def sigmoid(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return 1.0 / (1.0 + np.exp(-np.clip(x, -40, 40)))

    shoulder, elbow = body.point("shoulder"), body.point("elbow")
    other = nearest("trunk", "thigh", "shank", "foot", "skirt")
    own = nearest("upper_arm", "forearm", "palm", *FINGERS)
    arm = sigmoid((other - own) / 0.01)
    far = (p - shoulder) @ unit(elbow - shoulder) > 0.055 * STATURE
    arm = np.where(far, (other > own).astype(float), arm)
    head = sigmoid((nearest("neck", "trunk") - nearest("head")) / 0.006)
    head = np.maximum(head, p[:, 2] > body.point("head")[2])
    head *= p[:, 2] > body.point("neck")[2]
    thumb = sigmoid((nearest("palm", "index") - nearest("thumb")) / 0.004) * (nearest("thumb") < 0.02)
    return Membership(arm, np.zeros(len(p)), head, thumb)


def dense_weights(body: MeanBody, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, n_links) skin weights of the whole template, smoothed a little and symmetric."""
    p = vertices * (1.0, 0.0, 1.0) + np.abs(vertices) * (0.0, 1.0, 0.0)
    rows = weights_of(p, body.mark, membership(body, p))
    dense = np.zeros((len(p), N_LINKS))
    left = smoothstep(vertices[:, 1], -0.018, 0.018)
    if body.has_skirt:
        wide = smoothstep(vertices[:, 1], -0.11, 0.11)
        d = body.distances(p)
        cloth = smoothstep(np.delete(d, SEGMENT_IDX["skirt"], axis=1).min(axis=1), 0.004, 0.02)
        left = (1.0 - cloth) * left + cloth * wide
    for name, weight in rows.items():
        if name.startswith("l_"):
            dense[:, LINK_IDX[name]] += weight * left
            dense[:, LINK_IDX["r_" + name[2:]]] += weight * (1.0 - left)
        else:
            dense[:, LINK_IDX[name]] += weight
    mean = mean_value_matrix(vertices, faces)
    for _ in range(10):
        dense = 0.5 * dense + 0.5 * (mean @ dense)
    return dense


def make(hem: float | None, step: float, n_faces: int) -> dict[str, NDArray]:
    """All arrays of one template."""
    body = MeanBody(hem)
    for attempt in range(6):
        vertices, faces = fine_half(body, step * (1.0 + 0.01 * attempt), n_faces // 2)
        vertices, faces, mirror = mirrored(vertices, faces)
        if is_closed(faces):
            break
    else:
        raise RuntimeError("no grid gave a surface whose edges all have two faces")
    n_half = int((mirror >= np.arange(len(mirror))).sum())
    half_faces = faces[: len(faces) // 2]
    out = coordinates(body, vertices[:n_half], half_faces)
    dense = dense_weights(body, vertices, faces)
    swap = np.arange(N_LINKS)
    for name, i in LINK_IDX.items():
        if name[:2] in ("l_", "r_"):
            swap[i] = LINK_IDX[("r_" if name[0] == "l" else "l_") + name[2:]]
    dense = 0.5 * (dense + dense[mirror][:, swap])
    dense[dense < 0.004] = 0.0
    dense /= dense.sum(axis=1, keepdims=True)
    centre = vertices[half_faces].mean(axis=1)
    member = membership(body, centre)
    label = labels_of(centre, body.mark, member, weights_of(centre, body.mark, member))
    filled = dense > 0
    return (
        out
        | ring_weights(vertices[:n_half], half_faces)
        | {
            "faces": half_faces.astype(np.int32),
            "face_label": label,
            "on_plane": vertices[:n_half, 1] == 0.0,
            "indptr": np.concatenate([[0], np.cumsum(filled.sum(axis=1))]).astype(np.int32),
            "link": np.nonzero(filled)[1].astype(np.int8),
            "weight": dense[filled].astype(np.float32),
        }
    )


def main() -> None:
    """Writes the templates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", type=float, default=0.0035, help="grid spacing [m]")
    parser.add_argument("--faces", type=int, default=20000, help="triangles of the whole body")
    args = parser.parse_args()
    for name, hem in (("template", None), ("template_skirt", 0.45), ("template_long_skirt", 1.45)):
        arrays = make(hem, args.step, args.faces)
        path = OUT / f"{name}.npz"
        np.savez_compressed(path, **arrays)
        n_vertices, n_faces = len(arrays["indptr"]) - 1, 2 * len(arrays["faces"])
        print(f"{path.name}: {n_vertices} vertices, {n_faces} faces, {path.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main()
