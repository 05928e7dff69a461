"""The on-line system on clips: tracking, skeletons over time, and CPU time from an image to its last answer.

undergrowth generate out/clips --config examples/clips.toml --seed 9009
python benchmarks/bench_online.py out/clips [--sensor kinect_v2] [--walks FOREST] [--orientation NET.onnx]
python benchmarks/bench_online.py out/clips --mirror ...          # a crowd: with mirror images of now and of before
python benchmarks/bench_online.py out/clips --loop 108000 ...     # an hour of images, as fast as they go
python benchmarks/bench_online.py --planner
"""

import argparse
import itertools
import sys
import time
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]


from pipelines.corpus import Corpus  # noqa: E402
from pipelines.corpus.rooms.matching import REACH_M, level_distances, truths_of  # noqa: E402
from pipelines.online.detecting import PersonDetector  # noqa: E402
from pipelines.online.messages import (  # noqa: E402
    NS,
    CameraFrame,
    CameraPose,
    OrientationResult,
    Result,
    SkeletonResult,
    TrackedPersons,
    TrackSkeleton,
)
from pipelines.online.modules.inline import InlineModules  # noqa: E402
from pipelines.online.modules.jobs import ModuleSettings  # noqa: E402
from pipelines.online.modules.processes import ProcessModules  # noqa: E402
from pipelines.online.planner import ModuleStates, PlannerSettings, TrackStates, decide  # noqa: E402
from pipelines.online.system import OnlineSystem, SystemSettings  # noqa: E402
from pipelines.playing.sources import CorpusSource  # noqa: E402
from synth.vocabulary import JOINT_NAMES  # noqa: E402

TRUNK_M = 1.2
"""Height at which places are compared [m]."""
FIRST = 3
"""Images of a clip that do not count, since nobody can be sure of anybody yet."""


COST_S = 0.001
LATER = 40
"""The mirror images in a crowd are those of the present image and of so many images before."""
FARTHEST = np.uint16(65535)


class Truth(NamedTuple):
    """What is true of an image; the image itself is not kept."""

    clip: tuple
    people: object
    T_world_camera: np.ndarray
    joints: list


class EvenModules(InlineModules):
    """Modules whose answers all seem to cost COST_S: the planner chooses as many, however busy the machine is."""

    def collect(self, timeout_s=0.0):
        """What was answered, at the same price."""
        told = super().collect(timeout_s)
        return told._replace(results=tuple(replace(result, seconds=COST_S) for result in told.results))


class Played:
    """Everything that came of a corpus, with its truth."""

    def __init__(self, path, sensor, knows_pose, modules, budget_s, is_mirrored=False, chosen=(0, None)):
        self.tracks, self.poses, self.raw, self.smooth, self.facing = [], [], [], [], []
        self.seconds, self.n_results, self.truths = [], [], []
        corpus, source = Corpus.open(path), CorpusSource(path, sensor, knows_pose=knows_pose)
        system = OnlineSystem(
            PersonDetector(), EvenModules(modules), SystemSettings(planner=PlannerSettings(budget_s=budget_s))
        )
        counted, shown = Counter(), []
        for kind, handler in (
            (TrackedPersons, self.tracks.append),
            (CameraPose, self.poses.append),
            (SkeletonResult, self.raw.append),
            (TrackSkeleton, self.smooth.append),
            (OrientationResult, self.facing.append),
            (Result, lambda message: counted.update([message.stamp])),
        ):
            system.bus.subscribe(kind, handler)
        numbers, _ = source._order(corpus)
        for number, frame in itertools.islice(zip(numbers, source.frames(), strict=True), *chosen):
            scene = corpus.scene(int(number))
            clip, motions = (scene.info.split, scene.moment.clip), [one.motion for one in scene.people]
            joints = [motion.joints_world for motion in motions]
            self.truths.append(Truth(clip, truths_of(scene), scene.T_world_camera, joints))
            image = frame
            if is_mirrored:
                shown.append((frame.depth, scene.person > 0))
                image = crowded(frame, shown[-1:] + shown[-LATER:][:1])
            begun = time.process_time()
            system.step(image)
            self.seconds.append(time.process_time() - begun)
            self.n_results.append(counted[frame.stamp])


def crowded(frame, others):
    """An image with the mirror images of the people of images, (depth, is_person) each, where nothing is nearer."""
    depth = np.where(frame.depth > 0, frame.depth, FARTHEST)
    for other, is_person in others:
        depth = np.minimum(depth, np.where(is_person & (other > 0), other, FARTHEST)[:, ::-1])
    return replace(frame, depth=np.where(depth == FARTHEST, np.uint16(0), depth))


def places_of(truth, pose, persons):
    """(n, 2) places in the true world of tracks that live on a floor, which may be a found one [m]."""
    T_world_floor = truth.T_world_camera @ np.linalg.inv(pose.T_floor_camera)
    at = np.array([(*one.place, TRUNK_M, 1.0) for one in persons]).reshape(-1, 4)
    return (at @ T_world_floor.T)[:, :2]


def tracking(played):
    """MOTA, identity switches and person-frames by motmetrics."""
    import motmetrics as mm

    scores, names = [], []
    in_clip = 0
    for truth, pose, told in zip(played.truths, played.poses, played.tracks, strict=True):
        in_clip = in_clip + 1 if names and names[-1] == truth.clip else 0
        if in_clip == 0:
            names.append(truth.clip)
            scores.append(mm.MOTAccumulator(auto_id=True))
        if in_clip < FIRST:
            continue
        truths = truth.people
        off = level_distances(truths.trunk, places_of(truth, pose, told.persons))
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
    by_stamp = {told.stamp: (truth, told) for truth, told in zip(played.truths, played.tracks, strict=True)}
    at = defaultdict(list)
    for raw, smooth in zip(played.raw, played.smooth, strict=True):
        known, told = by_stamp[raw.stamp]
        person = next(one for one in told.persons if one.track_id == raw.track_id)
        off = level_distances(known.people.trunk, person.place[None])[0]
        if not len(off) or off.min() > REACH_M:
            continue
        truth = known.joints[int(off.argmin())][[JOINT_NAMES.index(name) for name in raw.joints]]
        T = known.T_world_camera
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


def endure(path, sensor, modules, budget_s, n_images):
    """Plays images round and round, modules in processes, and tells what memory and queues do."""
    import psutil

    images = [one for one in CorpusSource(path, sensor).frames() if isinstance(one, CameraFrame)][:300]
    runner = ProcessModules(modules)
    runner.wait_ready()
    system = OnlineSystem(PersonDetector(), runner, SystemSettings(planner=PlannerSettings(budget_s=budget_s)))
    results, waiting = Counter(), 0
    system.bus.subscribe(Result, lambda message: results.update([message.module]))
    own = psutil.Process()
    try:
        for k in range(n_images):
            system.step(replace(images[k % len(images)], stamp=k * NS // 30))
            waiting = max(waiting, sum(module.pending is not None for module in runner._modules.values()))
            system.finish()
            if (k + 1) % max(n_images // 12, 1) == 0:
                resident = [one.memory_info().rss / 2**20 for one in (own, *own.children(recursive=True))]
                print(
                    f"{k + 1} images ({(k + 1) / 108000:.2f} h): {resident[0]:.0f} MiB, all processes "
                    f"{sum(resident):.0f} MiB; {len(system._tracker._tracks)} tracks, {len(system._book._pages)} in "
                    f"the book, {len(system._poses)} poses, {runner._ring.n_taken} images being read, at most "
                    f"{waiting} waiting; answers {dict(results)}",
                    flush=True,
                )
    finally:
        runner.close()


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


def asked():
    """What the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", nargs="?", type=Path)
    parser.add_argument("--sensor")
    parser.add_argument("--no-pose", action="store_true", help="the camera's pose is not told")
    parser.add_argument("--walks")
    parser.add_argument("--orientation")
    parser.add_argument("--answers", type=int, default=50, help="an image, at most")
    parser.add_argument(
        "--mirror",
        action="store_true",
        help="put mirror images of everybody, now and 40 images ago, into the images",
    )
    parser.add_argument("--from", dest="first", type=int, default=0, help="the first image")
    parser.add_argument("--to", dest="end", type=int, help="the image after the last")
    parser.add_argument(
        "--loop", type=int, default=0, help="play so many images round and round, and watch memory"
    )
    parser.add_argument("--planner", action="store_true")
    return parser.parse_args()


def main():
    """Prints the table."""
    given = asked()
    if given.planner:
        planner()
    if given.clips is None:
        return
    kinds = (("walks", given.walks), ("orientation", given.orientation))
    modules = tuple(ModuleSettings(name, name, path, cost_s=COST_S) for name, path in kinds if path)
    if given.loop:
        endure(given.clips, given.sensor, modules, given.answers * COST_S + 1e-6, given.loop)
        return
    played = Played(
        given.clips,
        given.sensor,
        not given.no_pose,
        modules,
        given.answers * COST_S,
        given.mirror,
        (given.first, given.end),
    )
    milliseconds = np.percentile(played.seconds[FIRST:], [50, 95]) * 1e3
    print(f"CPU time of an image: {milliseconds[0]:.1f} ms in the median, {milliseconds[1]:.1f} ms at 95 %")
    n_people, n = (
        np.array([len(told.persons) for told in played.tracks[FIRST:]]),
        np.array(played.n_results[FIRST:]),
    )
    print(
        f"{n_people.mean():.1f} people and {n.mean():.1f} answers an image, at most {n_people.max()} and {n.max()}"
    )
    seconds = np.array(played.seconds[FIRST:])
    for name, is_such in (("10 answers", n == 10), ("10 answers or more", n >= 10)):
        if is_such.any():
            such = np.percentile(seconds[is_such], [50, 95]) * 1e3
            print(f"{is_such.sum()} images with {name}: {such[0]:.1f} ms in the median, {such[1]:.1f} ms at 95 %")
    if given.mirror:
        return
    found = tracking(played)
    print(
        f"{len(played.truths)} images: MOTA {found.mota:.3f}, IDF1 {found.idf1:.3f}, {found.num_switches:.0f} switches"
    )
    wrong = f"{found.num_misses:.0f} misses and {found.num_false_positives:.0f} false"
    print(f"{wrong} in {found.num_objects:.0f} person-images")
    if given.walks:
        error, jitter = skeletons(played)
        for name, (single, smooth) in (("error", error), ("jitter", jitter)):
            print(f"{name} of joints: {single.mean() * 100:.2f} cm single, {smooth.mean() * 100:.2f} cm smoothed")


if __name__ == "__main__":
    main()
