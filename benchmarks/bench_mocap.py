"""Poses a second from motion capture, how far limbs are off the source, and how placed poses keep the laws.

    python benchmarks/bench_mocap.py FOLDER [--bodies 30] [--seed 1]
    python benchmarks/bench_mocap.py FOLDER --positions

FOLDER holds BVH files; a trial in two conventions ("02_06_daz.bvh", "02_06_mb.bvh") is compared with itself.
With --positions, poses read as if there were no T-pose are compared with those counted from it: with the trunk as
the pose without turns draws it, and from joints whose axes point anywhere.
"""

import argparse
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from pipelines.commands.importing.mocap import MocapSettings
from pipelines.importing.subjects import trial_and_subject
from synth.bodies.body import Pose
from synth.bodies.mocap.bvh import Bvh, parse_bvh
from synth.bodies.mocap.retarget import Retargeted, retarget
from synth.bodies.mocap.roles import joints_of
from synth.bodies.mocap.select import joint_places
from synth.bodies.mocap.source import Source, read_source, read_source_from_positions
from synth.bodies.mocap.text import decode_bvh
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.poses.library import FOOT_UP, PoseLibrary
from synth.bodies.poses.place import place_pose
from synth.bodies.poses.sit import seat_contact, seat_height_of
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import LINK_IDX, Lengths, make_skeleton
from synth.bodies.spec import sample_body
from synth.vocabulary import JOINT_NAMES
from tests.mocap_files import with_axes_anywhere

LIMBS = {
    "upper_arm": "shoulder_rotation",
    "forearm": "elbow_flexion",
    "thigh": "hip_rotation",
    "shank": "knee_flexion",
}
PARTS = {
    **{name: (link, 2) for name, link in LIMBS.items()},
    "hand": ("wrist_deviation", 2),
    "palm": ("wrist_deviation", 1),
    "foot": ("ankle_inversion", 0),
    "sole": ("ankle_inversion", 2),
    "thorax": ("thorax_rotation", 2),
    "thorax, forward": ("thorax_rotation", 0),
    "head": ("head_rotation", 2),
    "head, forward": ("head_rotation", 0),
}
"""Link and its axis by part of the body."""
SKELETON = make_skeleton(Lengths.of_stature(1.7))


def angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles between unit vectors [degrees]."""
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0)))


def our_axes(poses: Retargeted) -> NDArray[np.float64]:
    """(n, n_links, 3, 3) rotations of all links, heading frame."""
    T = np.array([link_transforms(SKELETON, angles, np.eye(4)) for angles in poses.angles])
    return poses.root[:, None] @ T[:, :, :3, :3]


def angle_errors(source: Source, poses: Retargeted) -> dict[str, NDArray[np.float64]]:
    """By limb: angle between the source's direction and ours, all frames and both sides [degrees]."""
    R = our_axes(poses)
    turn = poses.root @ np.swapaxes(source.pelvis, 1, 2)  # world to heading frame
    limb = np.einsum("nab,nskb->nska", turn, source.limb)
    out = {}
    for k, (name, link) in enumerate(LIMBS.items()):
        ours = np.stack([-R[:, LINK_IDX[f"{s}_{link}"], :, 2] for s in "lr"], axis=1)
        out[name] = angle_between(ours, limb[:, :, k])
    for name, link, axis, directions in (
        ("hand", "wrist_deviation", 2, -source.fingers),
        ("foot", "ankle_inversion", 0, source.toes),
    ):
        ours = np.stack([R[:, LINK_IDX[f"{s}_{link}"], :, axis] for s in "lr"], axis=1)
        out[name] = angle_between(ours, np.einsum("nab,nsb->nsa", turn, directions))
    out["thorax"] = angle_between(R[:, LINK_IDX["thorax_rotation"], :, 2], (turn @ source.thorax)[:, :, 2])
    out["head"] = angle_between(R[:, LINK_IDX["head_rotation"], :, 0], (turn @ source.head)[:, :, 0])
    hips = 0.5 * (source.at("l_hip") + source.at("r_hip"))
    spine = source.at("neck") - hips
    spine = np.einsum("nab,nb->na", turn, spine / np.linalg.norm(spine, axis=1, keepdims=True))
    neck = joint_places(poses)[:, JOINT_NAMES.index("neck")]
    out["hips to neck"] = angle_between(neck / np.linalg.norm(neck, axis=1, keepdims=True), spine)
    return {name: error[~source.is_t_pose].ravel() for name, error in out.items()}


def show_errors(sources: list[Source], poses: list[Retargeted]) -> None:
    """Prints the angle errors of all files."""
    each = [angle_errors(source, own) for source, own in zip(sources, poses, strict=True)]
    print(f"{'off the direction given':22s} {'median':>7s} {'95 %':>7s} {'max':>7s}  [degrees]")
    for name in each[0]:
        error = np.concatenate([errors[name] for errors in each])
        print(f"{name:22s} {np.median(error):7.1f} {np.percentile(error, 95):7.1f} {error.max():7.1f}")


def show_speed(sources: list[Source]) -> None:
    """Prints the best of three."""
    retarget(sources[0])
    best = 0.0
    for _ in range(3):
        start = time.process_time()
        n = sum(len(retarget(source).angles) for source in sources)
        best = max(best, n / (time.process_time() - start))
    print(f"retargeting: {best:.0f} poses/s of CPU time")


def show_conventions(files: list[Path], poses: list[Retargeted]) -> None:
    """Prints how far a trial's two conventions are apart on our body."""
    for (a, own), (b, other) in pairwise(zip(files, poses, strict=True)):
        if trial_and_subject(a)[0] != trial_and_subject(b)[0]:
            continue
        way = np.linalg.norm(joint_places(own) - joint_places(other), axis=2)[1:]
        R, Q = our_axes(own)[1:], our_axes(other)[1:]
        apart = {
            name: np.median(
                [angle_between(R[:, i, :, 2], Q[:, i, :, 2]) for i in (LINK_IDX[f"{s}_{link}"] for s in "lr")]
            )
            for name, link in LIMBS.items()
        }
        joints = f"joints {100 * np.median(way):.1f} cm (95 %: {100 * np.percentile(way, 95):.1f})"
        print(f"{a.name} and {b.name}: {joints},", ", ".join(f"{n} {v:.1f}" for n, v in apart.items()), "degrees")


def show_positions(recordings: list[Bvh], sources: list[Source]) -> None:
    """Prints how far poses read without the T-pose are from those with it, per way of naming and of drawing."""
    anywhere = [with_axes_anywhere(bvh, np.random.default_rng(k)) for k, bvh in enumerate(recordings)]
    for naming in sorted({joints_of(bvh)[0].name for bvh in recordings}):
        rows = [k for k, bvh in enumerate(recordings) if joints_of(bvh)[0].name == naming]
        own = [sources[k] for k in rows]
        columns = [
            differences(own, [read_source_from_positions(given[k]) for k in rows])
            for given in (recordings, anywhere)
        ]
        print(
            f"{naming}, {len(rows)} files{'':12s} trunk straight     axes anywhere  median (95 %), [degrees], [cm]"
        )
        for part in columns[0]:
            figures = [
                f"{np.median(way):7.1f} ({np.percentile(way, 95):5.1f})" for way in (c[part] for c in columns)
            ]
            print(f"{part:30s}", *figures, sep="  ")


def differences(sources: list[Source], others: list[Source]) -> dict[str, NDArray[np.float64]]:
    """By part of our body and by joint: how far two readings of the same motions are apart [degrees], [cm]."""
    each: list[dict[str, NDArray[np.float64]]] = []
    for source, other in zip(sources, others, strict=True):
        own, without = retarget(source), retarget(other)
        is_open = ~source.is_t_pose
        R, Q = our_axes(own)[is_open], our_axes(without)[is_open]
        apart = {"pelvis": angle_between(own.root[:, :, 2], without.root[:, :, 2])[is_open]}
        for part, (link, axis) in PARTS.items():
            links = [LINK_IDX[link]] if link in LINK_IDX else [LINK_IDX[f"{s}_{link}"] for s in "lr"]
            apart[part] = angle_between(R[:, links, :, axis], Q[:, links, :, axis]).ravel()
        way = 100.0 * np.linalg.norm(joint_places(own) - joint_places(without), axis=2)[is_open]
        each.append(apart | {f"joint {name}": way[:, k] for k, name in enumerate(JOINT_NAMES)})
        each[-1]["all joints"] = way.ravel()
    return {part: np.concatenate([apart[part] for apart in each]) for part in each[0]}


def show_placed(library: PoseLibrary, n_bodies: int, seed: int) -> None:
    """Puts each pose on one of a number of sampled people and prints the laws' figures."""
    rng = np.random.default_rng(seed)
    bodies = [make_body(sample_body(rng, 0.15)) for _ in range(n_bodies)]
    bodies = [body for body in bodies if "skirt" not in body.spec.bottom]
    feet, below, seats, changes = [], [], [], {name: [] for name in LIMBS}
    n_fit = {False: 0, True: 0}
    seconds = 0.0
    for row in range(len(library)):
        body = bodies[row % len(bodies)]
        is_sitting = bool(library.is_sitting[row])
        height = seat_height_of(body) if is_sitting else None
        start = time.process_time()
        pose = place_pose(library, row, body, rng, height)
        seconds += time.process_time() - start if row >= len(bodies) else 0.0
        if pose is None:
            continue
        n_fit[is_sitting] += 1
        skin = pose_vertices(body, pose)
        below.append(-float(skin[:, 2].min()))
        if is_sitting:
            seats.append(float(seat_contact(body, pose)[2]) - height)
        else:
            marks = landmarks_of(body)
            low = {s: float(skin[marks.side[s].foot, 2].min()) for s in "lr"}
            feet += [abs(low[s]) for k, s in enumerate("lr") if library.feet[row, k] != FOOT_UP]
        for name, change in changed_limbs(library, row, pose).items():
            changes[name].append((is_sitting, change))
    print(f"placing: {(len(library) - len(bodies)) / seconds:.0f} poses/s of CPU time")
    for is_sitting, name in ((False, "standing"), (True, "sitting")):
        n = int((library.is_sitting == is_sitting).sum())
        moved = ", ".join(
            f"{limb} {np.median(own):.1f} / {np.percentile(own, 95):.1f}"
            for limb, pairs in changes.items()
            if (own := np.array([c for s, pair in pairs if s == is_sitting for c in pair])).size
        )
        print(
            f"{name}: {n_fit[is_sitting]} of {n} fit {len(bodies)} people; turned, median / 95 %: {moved} degrees"
        )
    print(f"feet off the floor, 95 % and max: {1000 * np.percentile(feet, 95):.1f} {1000 * max(feet):.1f} mm")
    print(
        f"skin below the floor, max: {1000 * max(below):.1f} mm; "
        f"seats off, max: {1000 * max(map(abs, seats), default=0.0):.1f} mm"
    )


def changed_limbs(library: PoseLibrary, row: int, pose: Pose) -> dict[str, list[float]]:
    """By limb: how far both sides' directions are off the library's after placing [degrees]."""
    T_world_root = np.eye(4)
    T_world_root[:3, :3] = library.root[row]
    before = link_transforms(SKELETON, library.angles[row].astype(np.float64), T_world_root)
    after = link_transforms(SKELETON, pose.angles, pose.T_world_root)
    links = {name: [LINK_IDX[f"{s}_{link}"] for s in "lr"] for name, link in LIMBS.items()}
    return {
        name: [float(angle_between(before[i, :3, 2], after[i, :3, 2])) for i in own] for name, own in links.items()
    }


def main() -> None:
    """Prints all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--bodies", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--positions", action="store_true")
    args = parser.parse_args()
    files = sorted(args.folder.rglob("*.bvh"))
    recordings = [parse_bvh(decode_bvh(path.read_bytes())) for path in files]
    sources = [read_source(bvh) for bvh in recordings]
    if args.positions:
        show_positions(recordings, sources)
        return
    show_speed(sources)
    poses = [retarget(source) for source in sources]
    show_errors(sources, poses)
    show_conventions(files, poses)
    show_placed(MocapSettings(args.folder, Path("unused")).library(), args.bodies, args.seed)


if __name__ == "__main__":
    main()
