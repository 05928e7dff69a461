"""The on-line system on clips: tracking, skeletons over time, and CPU time from an image to its last answer.

undergrowth generate out/clips --config examples/clips.toml --seed 9009
python benchmarks/bench_online.py out/clips [--sensor kinect_v2] [--walks FOREST] [--orientation NET.onnx]
python benchmarks/bench_online.py --planner
"""

import argparse
import itertools
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]


from pipelines.corpus import Corpus  # noqa: E402
from pipelines.corpus.rooms.matching import REACH_M, level_distances, truths_of  # noqa: E402
from pipelines.online.detecting import PersonDetector  # noqa: E402
from pipelines.online.messages import CameraPose, SkeletonResult, TrackedPersons, TrackSkeleton  # noqa: E402
from pipelines.online.modules.inline import InlineModules  # noqa: E402
from pipelines.online.modules.jobs import ModuleSettings  # noqa: E402
from pipelines.online.planner import ModuleStates, PlannerSettings, TrackStates, decide  # noqa: E402
from pipelines.online.system import OnlineSystem, SystemSettings  # noqa: E402
from pipelines.playing.sources import CorpusSource  # noqa: E402
from synth.vocabulary import JOINT_NAMES  # noqa: E402

TRUNK_M = 1.2
"""Height at which places are compared [m]."""
FIRST = 3
"""Images of a clip that do not count, since nobody can be sure of anybody yet."""


class Played:
    """Everything that came of a corpus, with its truth."""

    def __init__(self, path, sensor, knows_pose, modules, budget_s):
        self.tracks, self.poses, self.raw, self.smooth, self.seconds, self.n_results = [], [], [], [], [], []
        corpus, source = Corpus.open(path), CorpusSource(path, sensor, knows_pose=knows_pose)
        system = OnlineSystem(
            PersonDetector(), InlineModules(modules), SystemSettings(planner=PlannerSettings(budget_s=budget_s))
        )
        for kind, handler in (
            (TrackedPersons, self.tracks.append),
            (CameraPose, self.poses.append),
            (SkeletonResult, self.raw.append),
            (TrackSkeleton, self.smooth.append),
        ):
            system.bus.subscribe(kind, handler)
        numbers, _ = source._order(corpus)
        self.scenes = []
        for number, frame in zip(numbers, source.frames(), strict=True):
            self.scenes.append(corpus.scene(int(number)))
            before, begun = len(self.raw), time.process_time()
            system.step(frame)
            self.seconds.append(time.process_time() - begun)
            self.n_results.append(len(self.raw) - before)


def places_of(scene, pose, persons):
    """(n, 2) places in the true world of tracks that live on a floor, which may be a found one [m]."""
    T_world_floor = scene.T_world_camera @ np.linalg.inv(pose.T_floor_camera)
    at = np.array([(*one.place, TRUNK_M, 1.0) for one in persons]).reshape(-1, 4)
    return (at @ T_world_floor.T)[:, :2]


def tracking(played):
    """MOTA, identity switches and person-frames by motmetrics."""
    import motmetrics as mm

    scores, names = [], []
    in_clip = 0
    for scene, pose, told in zip(played.scenes, played.poses, played.tracks, strict=True):
        clip = (scene.info.split, scene.moment.clip)
        in_clip = in_clip + 1 if names and names[-1] == clip else 0
        if in_clip == 0:
            names.append(clip)
            scores.append(mm.MOTAccumulator(auto_id=True))
        if in_clip < FIRST:
            continue
        truths = truths_of(scene)
        off = level_distances(truths.trunk, places_of(scene, pose, told.persons))
        off[:, ~truths.is_seen] = np.inf
        off[off > REACH_M] = np.nan
        wanted = np.flatnonzero(truths.is_wanted)
        # A track of somebody who need not be found counts neither for nor against.
        is_free = np.array([np.isfinite(row).any() and not np.isfinite(row[wanted]).any() for row in off], bool)
        kept = np.flatnonzero(~is_free)
        scores[-1].update(wanted, [told.persons[k].track_id for k in kept], off[np.ix_(kept, wanted)].T ** 2)
    measures = ["mota", "num_switches", "num_misses", "num_false_positives", "num_objects", "idf1"]
    return mm.metrics.create().compute_many(scores, metrics=measures, generate_overall=True).loc["OVERALL"]


def skeletons(played):
    """Errors and jitter of single images and of smoothed skeletons, on the same joints."""
    by_stamp = {told.stamp: (scene, told) for scene, told in zip(played.scenes, played.tracks, strict=True)}
    at = defaultdict(list)
    for raw, smooth in zip(played.raw, played.smooth, strict=True):
        scene, told = by_stamp[raw.stamp]
        person = next(one for one in told.persons if one.track_id == raw.track_id)
        off = level_distances(truths_of(scene).trunk, person.place[None])[0]
        if not len(off) or off.min() > REACH_M:
            continue
        motion = scene.people[int(off.argmin())].motion
        truth = motion.joints_world[[JOINT_NAMES.index(name) for name in raw.joints]]
        T = scene.T_world_camera
        at[raw.track_id].append(
            (raw.stamp, raw.positions @ T[:3, :3].T + T[:3, 3] - truth, smooth.positions - truth)
        )
    errors, jitter = [], []
    for rows in at.values():
        for (stamp, *now), (after, *then) in itertools.pairwise(rows):
            errors.append([np.linalg.norm(values, axis=1) for values in then])
            if after - stamp < 5e7:
                jitter.append([np.linalg.norm(b - a, axis=1) for a, b in zip(now, then, strict=True)])
    out = []
    for values in (errors, jitter):
        pairs = np.array(values).transpose(1, 0, 2).reshape(2, -1)
        out.append(pairs[:, np.isfinite(pairs).all(axis=0)])
    return out


def planner():
    """Seconds of a decision for 50 tracks and 3 modules."""
    rng = np.random.default_rng(0)
    tracks = TrackStates(
        rng.uniform(0.5, 8, 50),
        rng.uniform(-2, 2, 50),
        rng.uniform(-1, 1, 50),
        rng.uniform(0, 1, 50),
        np.ones(50, bool),
        rng.exponential(0.3, (50, 3)),
    )
    modules = ModuleStates(
        np.array([0.002, 0.001, 0.015]), np.zeros(3), np.full(3, 9.0), np.ones(3), np.ones(3, bool)
    )
    seconds = []
    for _ in range(3000):
        begun = time.perf_counter()
        decide(tracks, modules, PlannerSettings())
        seconds.append(time.perf_counter() - begun)
    print(f"decision for 50 tracks: {np.median(seconds[100:]) * 1e6:.1f} us in the median")


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", nargs="?", type=Path)
    parser.add_argument("--sensor")
    parser.add_argument("--no-pose", action="store_true", help="the camera's pose is not told")
    parser.add_argument("--walks")
    parser.add_argument("--orientation")
    parser.add_argument("--budget", type=float, default=0.02)
    parser.add_argument("--planner", action="store_true")
    given = parser.parse_args()
    if given.planner:
        planner()
    if given.clips is None:
        return
    kinds = (("walks", given.walks, 0.002), ("orientation", given.orientation, 0.001))
    modules = tuple(ModuleSettings(name, name, path, cost_s=cost) for name, path, cost in kinds if path)
    played = Played(given.clips, given.sensor, not given.no_pose, modules, given.budget)
    found = tracking(played)
    print(
        f"{len(played.scenes)} images: MOTA {found.mota:.3f}, IDF1 {found.idf1:.3f}, {found.num_switches:.0f} switches"
    )
    wrong = f"{found.num_misses:.0f} misses and {found.num_false_positives:.0f} false"
    print(f"{wrong} in {found.num_objects:.0f} person-images")
    milliseconds = np.percentile(played.seconds[FIRST:], [50, 95]) * 1e3
    print(f"CPU time of an image: {milliseconds[0]:.1f} ms in the median, {milliseconds[1]:.1f} ms at 95 %")
    if given.walks:
        error, jitter = skeletons(played)
        print(f"{np.mean(played.n_results):.1f} skeletons an image, at most {max(played.n_results)}")
        for name, (single, smooth) in (("error", error), ("jitter", jitter)):
            print(f"{name} of joints: {single.mean() * 100:.2f} cm single, {smooth.mean() * 100:.2f} cm smoothed")


if __name__ == "__main__":
    main()
