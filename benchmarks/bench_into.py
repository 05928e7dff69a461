"""Composition of drawn objects into recorded frames: frames a second on one core, gaps, and how much is hidden.

    python benchmarks/bench_into.py RECORDED_CORPUS [--frames 960] [--sensor kinect_v1]

The corpus is one of `undergrowth import depth`. Gaps are measured again from the records, between the
objects' solids and every recorded point.
"""

import argparse
import cProfile
import pstats
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from pipelines.commands.generate import GenerateSettings
from pipelines.corpus import Corpus, write_corpus
from synth.frame import Frame
from synth.geometry import transform_points
from synth.occluders import registry
from synth.occluders.solids.distance import solid_distances
from synth.scene.composed import ComposeConfig
from synth.scene.composed.person import person_of
from synth.vocabulary import JointState

STAGES = (
    ("objects built", "pools.py", "_make_object"),
    ("reading", "read.py", "frame"),
    ("the person's points", "person.py", "person_of"),
    ("placing objects (those built included)", "furniture.py", ""),
    ("rendering", "rasterize.py", "render"),
    ("sensor", "overlay.py", "as_measured"),
    ("frames in all", "compose.py", "compose"),
)
FAMILIES = ("desk", "stroller", "chair", "clutter", "several")


def settings(path: Path, n_frames: int, sensor: str) -> GenerateSettings:
    """What `generate --into` would be asked for."""
    return GenerateSettings(Path("unused"), frames=n_frames, into=path, compose=ComposeConfig(sensor=sensor))


def cumulative(stats: pstats.Stats, file: str, function: str) -> float:
    """Cumulative seconds of a function; of the families called by the composer if it has no name."""
    total = 0.0
    for (path, _, name), (_, _, _, seconds, callers) in stats.stats.items():  # type: ignore[attr-defined]
        if not path.endswith(file):
            continue
        if name == function:
            total += seconds
        elif not function and name in FAMILIES:
            total += sum(row[3] for (caller, _, _), row in callers.items() if caller.endswith("compose.py"))
    return total


def smallest_gaps(frame: Frame) -> list[float]:
    """Distance of each object on the floor to the recorded points [m]."""
    person = person_of(frame, frame.T_world_camera, frame.T_world_root)
    points = transform_points(person.T_world_scene, person.surface)
    return [
        float(
            solid_distances(
                registry.make(registry.from_plain(item.spec)).solids, item.T_world_object, points
            ).min()
        )
        for item in frame.info.objects
    ]


def print_contents(corpus: Corpus) -> None:
    """Prints families, visible shares, joint states and gaps."""
    infos = [corpus.info(int(i)) for i in corpus.indices]
    print(
        "families:", ", ".join(f"{name} {n}" for name, n in Counter(i.scene_family for i in infos).most_common())
    )
    shares = [info.visible_fraction for info in infos if info.objects]
    print("visible share of the person, 5, 25, 50, 75, 95 %:", np.percentile(shares, (5, 25, 50, 75, 95)).round(2))
    states = corpus.arrays("joint_state")
    known = states[states != JointState.UNKNOWN]
    print(
        "known joints:",
        ", ".join(f"{(known == s).mean():.1%} {s.name.lower()}" for s in JointState if s.value < 4),
    )
    gaps = [found for i in corpus.indices[::4] if (found := smallest_gaps(corpus[int(i)]))]
    nearest, all_gaps = np.array([min(found) for found in gaps]), np.concatenate(gaps)
    print(
        f"nearest object of {len(gaps)} frames, min, median, max: "
        f"{', '.join(f'{1e3 * v:.1f}' for v in np.percentile(nearest, (0, 50, 100)))} mm; "
        f"all {len(all_gaps)} objects: min {1e3 * all_gaps.min():.1f} mm"
    )


def main() -> None:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--frames", type=int, default=960)
    parser.add_argument("--sensor", default="kinect_v1")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        write_corpus(Path(folder) / "first", settings(options.corpus, 16, options.sensor).order())
        print(f"compilation and first frames: {time.perf_counter() - begin:.1f} s")
        begin = time.perf_counter()
        order = settings(options.corpus, options.frames, options.sensor).order()
        print(f"finding the floor: {time.perf_counter() - begin:.2f} s, {order.config['into']['floor']}")
        cpu, wall = time.process_time(), time.perf_counter()
        write_corpus(Path(folder) / "c", order)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        n = options.frames
        print(
            f"one process: {n / cpu:.1f} frames/s of CPU time ({1e3 * cpu / n:.1f} ms a frame), "
            f"{n / wall:.1f} frames/s by the clock"
        )
        print_contents(Corpus.open(Path(folder) / "c"))
        profile = cProfile.Profile()
        profile.runcall(write_corpus, Path(folder) / "again", order)
    stats = pstats.Stats(profile)
    total = stats.total_tt  # type: ignore[attr-defined]
    print(f"under the profiler: {1e3 * total / n:.2f} ms a frame, of it")
    for label, file, function in STAGES:
        seconds = cumulative(stats, file, function)
        print(f"  {label:40} {1e3 * seconds / n:6.2f} ms {seconds / total:6.1%}")


if __name__ == "__main__":
    main()
