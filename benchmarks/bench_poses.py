"""Poses a second by family, rejections, and the kernels below them.

    python benchmarks/bench_poses.py [--draws 64] [--bodies 8]

Compile time is printed apart: it is the first call of everything.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.poses.families import FAMILIES
from synth.bodies.poses.hands import HandTarget, HandTargets
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.rig.collision import self_collides
from synth.bodies.rig.ik import Goal, solve_limb
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import LINK_IDX, LOWER, UPPER
from synth.bodies.spec import sample_body


def targets_for(family: str, person: Body, base: Pose) -> HandTargets | None:
    """A table, laptop or handle about where a scene would put it."""
    context, stature = FAMILIES[family].context, person.spec.stature
    if context == "none":
        return None
    if context == "stroller":
        x, z = 0.25 * stature, 0.57 * stature
        return HandTargets(left=HandTarget((x, 0.18, z), "handle"), right=HandTarget((x, -0.18, z), "handle"))
    marks = landmarks_of(person)
    skin = pose_vertices(person, base)
    arms = np.concatenate([np.r_[marks.side[s].hand, marks.side[s].forearm] for s in "lr"])
    trunk = np.delete(skin, arms, axis=0)
    if context == "laptop_lap":
        lap = trunk[(trunk[:, 0] > 0.4 * marks.thigh) & (trunk[:, 2] < base.T_world_root[2, 3] + 0.2)]
        height, x = float(lap[:, 2].max()) + 0.02, 0.75 * marks.thigh
    else:
        height = float(base.T_world_root[2, 3]) + 0.115 * stature
        near = trunk[(np.abs(trunk[:, 2] - height) < 0.05) & (np.abs(trunk[:, 1]) < 0.15)]
        x = float(near[:, 0].max()) + 0.04
    keys = [
        HandTarget((x + (0.17 if context == "laptop_table" else 0.05), y, height), "keyboard")
        for y in (0.07, -0.07)
    ]
    chosen = (None, None) if context == "table" else tuple(keys)
    return HandTargets(height, (x, x + 0.7, -0.6, 0.6), *chosen)


def median_us(call: Callable[[], object], repeats: int = 200) -> float:
    """Median time of a call after a first one [us]."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e6 * float(np.median(times))


def bench_kernels(person: Body) -> None:
    rng = np.random.default_rng(0)
    pose = Pose(rng.uniform(0.3 * LOWER, 0.3 * UPPER), np.eye(4))
    T = link_transforms(person.skeleton, pose.angles, pose.T_world_root)
    hand = T[LINK_IDX["l_wrist_deviation"]]
    goals = [
        Goal("wrist_deviation", (0, 0, -0.05), hand[:3, 3] - 0.05 * hand[:3, 2]),
        Goal("wrist_deviation", (0, -1, 0), -hand[:3, 1], 0.1, is_point=False),
        Goal("wrist_deviation", (0, 0, -1), -hand[:3, 2], 0.05, is_point=False),
    ]
    start = np.clip(np.full(len(LOWER), 0.2), LOWER, UPPER)
    T_start = link_transforms(person.skeleton, start, np.eye(4))
    n = len(person.mesh.vertices)
    print(f"{n} vertices, {person.weights.indptr[-1] / n:.1f} weights a vertex")
    rows = {
        "forward kinematics, 50 links": lambda: link_transforms(person.skeleton, pose.angles, pose.T_world_root),
        "skinning, all vertices": lambda: pose_vertices(person, pose),
        "inverse kinematics, one arm": lambda: solve_limb(person.skeleton, "l_arm", T_start, start, goals),
        "self-collision, all limbs": lambda: self_collides(person, pose),
    }
    for name, call in rows.items():
        print(f"  {name:30s} {median_us(call):8.1f} us")


def bench_family(family: str, people: list[Body], n_draws: int) -> tuple[float, float, float]:
    base_s, arms_s, n_rejected = [], [], 0
    for k in range(n_draws):
        person, rng = people[k % len(people)], np.random.default_rng([k, 1])
        start = time.perf_counter()
        base = draw_base(family, person, rng)
        base_s.append(time.perf_counter() - start)
        targets = targets_for(family, person, base)
        start = time.perf_counter()
        n_rejected += draw_arms(family, person, base, rng, targets) is None
        arms_s.append(time.perf_counter() - start)
    return 1e3 * float(np.median(base_s)), 1e3 * float(np.median(arms_s)), n_rejected / n_draws


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=64, help="draws a family")
    parser.add_argument("--bodies", type=int, default=8)
    args = parser.parse_args()
    people = [make_body(sample_body(np.random.default_rng(seed))) for seed in range(args.bodies)]
    start = time.perf_counter()
    for family in FAMILIES:
        bench_family(family, people[:1], 1)
    print(f"first call of everything (compiles or loads the cache): {time.perf_counter() - start:.1f} s")
    start = time.perf_counter()
    for person in people[1:]:
        draw_base("standing", person, np.random.default_rng(0))
    print(f"fitting a body, once: {1e3 * (time.perf_counter() - start) / max(len(people) - 1, 1):.0f} ms")
    bench_kernels(people[0])
    print(f"{'family':22s} {'base ms':>8s} {'arms ms':>8s} {'poses/s':>8s} {'rejected':>9s}")
    for family in FAMILIES:
        base, arms, rejected = bench_family(family, people, args.draws)
        print(f"{family:22s} {base:8.2f} {arms:8.2f} {1e3 / (base + arms):8.0f} {rejected:9.1%}")


if __name__ == "__main__":
    main()
