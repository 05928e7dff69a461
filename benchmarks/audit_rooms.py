"""Measures with libigl how deep people in rooms sink into each other and into things, on meshes made from the record.

Skin against skin and skin against every closed mesh near it, both ways; for open meshes points on their surface
against the skin. Also prints what views the rooms give: how many people are seen, and what hides their joints.

    python benchmarks/audit_rooms.py [--frames 100] [--seed 0] [--config examples/rooms.toml]
"""

import argparse
import functools
import json
from collections import Counter
from pathlib import Path

import igl
import numpy as np
from tqdm import tqdm

from pipelines.commands.generate import GenerateSettings
from synth.bodies.body import Body, Pose
from synth.bodies.rig.skinning import posed_mesh
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec
from synth.frame import RoomFrame
from synth.geometry import LabelledMesh, surface_points
from synth.occluders.background.catalogue import from_plain, make
from synth.scene import RoomSource
from synth.vocabulary import JointState

LIMIT = 0.01
NEAR = 0.05
"""Points farther from a mesh's box than this are not measured [m]."""
SHELL = ("floor", "wall", "ceiling")


def gap_to(mesh: LabelledMesh, points: np.ndarray) -> float:
    """Least signed distance of the points near a closed mesh to it, by libigl, negative inside [m]; at most `NEAR`."""
    vertices = mesh.vertices.astype(np.float64)
    is_near = ((points > vertices.min(axis=0) - NEAR) & (points < vertices.max(axis=0) + NEAR)).all(axis=1)
    if not is_near.any():
        return NEAR
    distances = igl.signed_distance(points[is_near].astype(np.float64), vertices, mesh.faces.astype(np.int64))[0]
    return min(NEAR, float(distances.min()))


@functools.lru_cache(maxsize=64)
def body_of(subject: str) -> Body:
    return make_body(BodySpec(**json.loads(subject)))


@functools.lru_cache(maxsize=256)
def thing_of(spec: str) -> tuple[LabelledMesh, np.ndarray]:
    mesh = make(from_plain(json.loads(spec))).mesh
    return mesh, surface_points(mesh, 0.02)


def skins_of(frame: RoomFrame) -> list[LabelledMesh]:
    """Everybody's skin, made again from the record alone."""
    skins = []
    for record, view in zip(frame.info.people, frame.people, strict=True):
        pose = Pose(view.angles.astype(np.float64), view.T_world_root)
        skins.append(posed_mesh(body_of(json.dumps(record.subject)), pose))
    return skins


def audit(frame: RoomFrame) -> tuple[list[float], float]:
    """Gaps between the skins of pairs, at most `NEAR`, and the deepest overlap of a skin and a thing [m]."""
    skins = skins_of(frame)
    between = [min(gap_to(a, b.vertices), gap_to(b, a.vertices)) for k, a in enumerate(skins) for b in skins[:k]]
    deepest = 0.0
    for item in frame.info.objects:
        if item.class_name in SHELL:
            continue
        bare, surface = thing_of(json.dumps(item.spec))
        mesh = bare.transformed(item.T_world_object)
        T = np.array(item.T_world_object)
        for skin in skins:
            gap = gap_to(skin, surface @ T[:3, :3].T + T[:3, 3])
            if mesh.is_closed:
                gap = min(gap, gap_to(mesh, skin.vertices))
            deepest = max(deepest, -gap)
    return between, deepest


def main() -> None:
    """Runs the audit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--config", type=Path, default=Path("examples/rooms.toml"))
    options = parser.parse_args()
    between, deepest, n_seen = [], [], []
    states: Counter[str] = Counter()
    for frame in tqdm(RoomSource(GenerateSettings.from_toml(options.config).scene, options.seed, options.frames)):
        gaps, overlap = audit(frame)
        between += gaps
        deepest.append(overlap)
        n_seen.append(sum(one.visible_fraction >= 0.25 for one in frame.info.people))
        for view, one in zip(frame.people, frame.info.people, strict=True):
            if one.visible_fraction > 0.0:
                states.update(JointState(int(state)).name.lower() for state in view.joint_state)
    n = len(deepest)
    over = sum(depth > LIMIT for depth in deepest)
    share = ", ".join(f"{name} {100 * count / states.total():.1f} %" for name, count in states.most_common())
    print(f"{n} frames; skin and things overlap by over 1 cm in {over}; deepest {1000 * max(deepest):.1f} mm")
    near = [gap for gap in between if gap < NEAR]
    told = f"least {1000 * min(near):.1f} mm" if near else "none"
    print(
        f"{len(between)} pairs of people; gaps between their skins below {100 * NEAR:.0f} cm: {len(near)}, {told}"
    )
    print(f"people of whom at least a quarter is seen, a frame: {np.mean(n_seen):.2f} (of 0..8)")
    print(f"joints of people who are seen at all: {share}")


if __name__ == "__main__":
    main()
