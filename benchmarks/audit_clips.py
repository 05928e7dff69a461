"""How people of clips move: do feet slide or sink, do joints accelerate as recorded ones, do limbs go through things?

    python benchmarks/audit_clips.py [--clips 24] [--seed 0] [--steps 150] [--mocap FOLDER] [--motions FILE] [--bytes]

FOLDER holds BVH files. Their joints and the clips' are compared at 30 positions a second. FILE is a motion library:
everybody on their feet then moves as recorded in its train split. With --bytes a small corpus is written by one and by
two processes as well, and compared.
"""

import argparse
import hashlib
import itertools
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from tqdm import tqdm

from pipelines.corpus import Corpus, write_corpus
from pipelines.generation.drawn import drawn_order
from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.source import read_source
from synth.bodies.mocap.text import decode_bvh
from synth.bodies.motion.foot import foot_shapes
from synth.bodies.motion.library import read_motions
from synth.bodies.poses.draft import Draft
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.skeleton import LINK_IDX
from synth.geometry import transform_points
from synth.scene import ClipSource, MotionMix, SceneConfig
from synth.scene.clips.actors import Actor
from synth.scene.clips.stage import Stage
from synth.scene.config import SplitShares
from synth.scene.draw import SEAT
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import JOINT_NAMES, N_PARTS

FPS = 30
DEEP = 0.01
"""Skin this deep in something counts [m]."""
SPEEDS = (0.5, 0.8, 1.1, 1.5)
"""Accelerations are compared below the first of these speeds of the hips, and between each and the next [m/s]."""
ROLES = {
    "head": "head", "neck": "neck", "r_shoulder": "r_shoulder", "l_shoulder": "l_shoulder", "r_elbow": "r_elbow",
    "l_elbow": "l_elbow", "r_hand": "r_wrist", "l_hand": "l_wrist", "r_hip": "r_hip", "l_hip": "l_hip",
    "r_knee": "r_knee", "l_knee": "l_knee", "r_foot": "r_ankle", "l_foot": "l_ankle",
}  # fmt: skip
"""Recorded joint that is nearest to each of ours."""


def scene(steps: int) -> SceneConfig:
    """Rooms of all kinds with one to four people."""
    return SceneConfig(
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=(1, 4)),
        splits=SplitShares(1.0, 0.0, 0.0),
        clip=steps,
        fps=float(FPS),
    )


def accelerations(joints: np.ndarray) -> np.ndarray:
    """(n - 2, n_joints) of positions 30 a second [m/s^2]."""
    return np.linalg.norm(np.diff(joints, 2, axis=0), axis=-1) * FPS**2


def slides(actor: Actor) -> list[tuple[str, float]]:
    """How far what is down moves over the floor, for each time that heel, toes or both are down [m]."""
    motion, shapes = actor.motion, foot_shapes(actor.subject.body)
    out = []
    for side, column in (("l", 0), ("r", 2)):
        link = LINK_IDX[f"{side}_ankle_inversion"]
        placed = zip(motion.angles, motion.T_world_root, strict=True)
        T = np.array([link_transforms(actor.subject.body.skeleton, a, root)[link] for a, root in placed])
        shape = shapes[side]
        heel, ball = (
            (x, 0.0, z - shape.ankle, 1.0) for x, z in ((shape.heel, 0.0), (shape.ball, shape.ball_height))
        )
        down = motion.contacts[:, column : column + 2]
        for k, point, how in ((0, heel, "heel"), (1, ball, "toes")):
            place = (T @ np.array(point))[:, :2]
            step = np.hypot(*np.diff(place, axis=0).T)
            is_down = down[1:, k] & down[:-1, k]
            number = np.cumsum(np.diff(np.concatenate([[0], is_down.astype(int)])) == 1)
            if is_down.any():
                out += [(how, float(way)) for way in np.bincount(number[is_down], weights=step[is_down])[1:]]
    return out


def depths(stage: Stage, k: int, vertices: np.ndarray) -> dict[str, float]:
    """How deep the skin of a person is in the room's things, in their own seat and in those of others [m]."""
    actor = stage.actors[k]
    things = {"furniture": stage.room.items[stage.room.n_surfaces :]}
    things |= {"other seats": tuple(item for item in stage.seats if item is not actor.seat)}
    out = {}
    for name, items in things.items():
        near = [item.gap(vertices, 0.05) for item in items if _is_near(item, vertices)]
        out[name] = max(0.0, -min(near, default=0.0))
    if actor.seat is not None:
        out["own seat, what sits on it"] = max(0.0, -actor.seat.gap(vertices[is_of(actor, SEAT)], 0.05))
        others = frozenset(range(1, N_PARTS + 1)) - SEAT
        out["own seat, other parts"] = max(0.0, -actor.seat.gap(vertices[is_of(actor, others)], 0.05))
    return out


def is_of(actor: Actor, parts: frozenset[int]) -> np.ndarray:
    return np.isin(actor.subject.vertex_part, list(parts))


def _is_near(item, vertices: np.ndarray) -> bool:
    points = transform_points(item.T_world_object, item.surface)
    return bool(((points.max(axis=0) > vertices.min(axis=0)) & (points.min(axis=0) < vertices.max(axis=0))).all())


def speed_class(hips: np.ndarray) -> np.ndarray:
    """(n - 2,) class in `SPEEDS` of hips (n, 3), 30 positions a second; 0 = slower than the first."""
    return np.searchsorted(SPEEDS, np.hypot(*((hips[2:] - hips[:-2])[:, :2] * FPS / 2.0).T))


def recorded(folder: Path) -> dict[tuple[str, int], np.ndarray]:
    """Accelerations of recorded joints by our names and class of speed [m/s^2]; files are thinned to 30 Hz."""
    out = defaultdict(list)
    for path in sorted(folder.glob("*.bvh")):
        bvh = parse_bvh(decode_bvh(path.read_bytes()))
        source = read_source(bvh)
        stride = max(1, round(1.0 / (FPS * bvh.frame_time)))
        first = 1 + int(np.flatnonzero(source.is_t_pose).max(initial=-1))
        classes = speed_class(source.at("l_hip")[first::stride])
        for name, role in ROLES.items():
            if role in source.joints:
                place = source.at(role)
                if name.endswith("foot"):
                    place = 0.5 * (place + source.at(role.replace("ankle", "toe")))
                values = accelerations(place[first::stride][:, None])[:, 0]
                for k in range(len(SPEEDS)):
                    out[name, k].append(values[classes == k])
    return {name: np.concatenate(values) for name, values in out.items()}


def audit(options: argparse.Namespace) -> dict[tuple[str, int], np.ndarray]:
    """Prints what was measured; gives the accelerations by joint."""
    mix = None if options.motions is None else MotionMix(read_motions(options.motions), 1.0, ("train",))
    source = ClipSource(scene(options.steps), options.seed, options.clips * options.steps, poses=mix)
    found, lowest, self_depth = [], [], []
    deep: dict[str, list[float]] = defaultdict(list)
    acting = defaultdict(list)
    acts, turns = defaultdict(int), defaultdict(int)
    for number in tqdm(range(options.clips)):
        clip = source.clip("train", number)
        stride = clip.stage.stride
        for k, actor in enumerate(clip.stage.actors):
            acts[actor.act] += 1
            for name in actor.motion.activity[::stride]:
                turns[name.split("_")[0]] += 1
            found += slides(actor)
            joints = clip.joints[k, ::stride]
            classes = speed_class(joints[:, JOINT_NAMES.index("l_hip")])
            for j, name in enumerate(JOINT_NAMES):
                values = accelerations(joints)[:, j]
                for speed in range(len(SPEEDS)):
                    acting[name, speed].append(values[classes == speed])
            for step in range(0, options.steps, 10):
                pose = actor.motion.pose(step * stride)
                vertices = pose_vertices(actor.subject.body, pose).astype(np.float64)
                lowest.append(float(vertices[:, 2].min()))
                self_depth.append(Draft.of(actor.subject.body, pose).excess())
                for name, depth in depths(clip.stage, k, vertices).items():
                    deep[name].append(depth)
    print(f"{options.clips} clips of {options.steps} steps at {FPS} a second; people: {dict(acts)}")
    total = sum(turns.values())
    print(
        "moments: "
        + ", ".join(f"{name} {n / total:.0%}" for name, n in sorted(turns.items(), key=lambda x: -x[1]))
    )
    for how in ("heel", "toes"):
        ways = 1000 * np.array([way for name, way in found if name == how])
        share = np.mean(ways <= 10.0)
        print(
            f"{how} down {len(ways)} times: slides by median {np.median(ways):.1f}, "
            f"95 % {np.percentile(ways, 95):.1f}, most {ways.max():.1f} mm; at most 10 mm in {share:.1%}"
        )
    low = 1000 * np.array(lowest)
    print(f"lowest skin of {len(low)} poses: 1 % {np.percentile(low, 1):.1f}, least {low.min():.1f} mm")
    for name, listed in {"own body": self_depth, **deep}.items():
        values = np.array(listed)
        print(
            f"skin over {1000 * DEEP:.0f} mm deep in {name}: {np.mean(values > DEEP):.1%} of {len(values)} poses; "
            f"99 % {1000 * np.percentile(values, 99):.0f}, deepest {1000 * values.max():.0f} mm"
        )
    return {name: np.concatenate(values) for name, values in acting.items()}


def same_bytes() -> None:
    """Whether one and two processes write the same."""
    digests = set()
    order = drawn_order(scene(32), 3, 4 * 32)
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            write_corpus(Path(folder) / "c", order, workers)
            digests.add(hashlib.sha256(Corpus.open(Path(folder) / "c").digest.encode()).hexdigest())
    print(
        f"128 frames by one and by two processes: {'the same bytes' if len(digests) == 1 else 'DIFFERENT BYTES'}"
    )


def main() -> None:
    """Runs the audit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", type=int, default=24)
    parser.add_argument("--steps", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mocap", type=Path)
    parser.add_argument("--motions", type=Path)
    parser.add_argument("--bytes", action="store_true")
    options = parser.parse_args()
    ours = audit(options)
    theirs = {} if options.mocap is None else recorded(options.mocap)
    names = [f"below {SPEEDS[0]}", *(f"{a} to {b}" for a, b in itertools.pairwise(SPEEDS))]
    print(f"acceleration [m/s2], 95 % quantile in clips (recordings), by speed [m/s]: {'; '.join(names)}")
    for name in JOINT_NAMES:
        words = []
        for k in range(len(SPEEDS)):
            other = f" ({np.percentile(theirs[name, k], 95):4.1f})" if (name, k) in theirs else ""
            words.append(f"{np.percentile(ours[name, k], 95):5.1f}{other}")
        print(f"  {name:12} {'; '.join(words)}")
    if options.bytes:
        same_bytes()


if __name__ == "__main__":
    main()
