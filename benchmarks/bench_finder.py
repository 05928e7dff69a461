"""People found on held-out rooms: recall at one false box in ten frames, with 95 % intervals, and frames a second.

undergrowth generate out/other --config examples/rooms.toml --seed 5005 --frames 256
python benchmarks/bench_finder.py out/other [--sensor kinect_v2 kinect_v1] [--pictures FOLDER]
python benchmarks/bench_finder.py --image depth.png --camera 525 525 319.5 239.5 --pictures FOLDER
"""

import argparse
import math
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from forests.finder.find import PeopleFinder  # noqa: E402
from forests.finder.floor import FloorPrior, NoFloorError, find_floor  # noqa: E402
from forests.finder.model import SHIPPED, read_finder, template_scores, tree_scores  # noqa: E402
from forests.finder.probes import contour, view_of  # noqa: E402
from forests.frames import Intrinsics  # noqa: E402
from pipelines.corpus import Corpus  # noqa: E402
from pipelines.corpus.rooms.matching import (  # noqa: E402
    DISTANCES,
    MIN_VISIBLE,
    floor_of,
    judge_axes,
    recall_at,
    truths_of,
)
from pipelines.drawing.files import write_picture  # noqa: E402
from pipelines.drawing.found import found_picture  # noqa: E402
from synth.vocabulary import SCENE_CODE  # noqa: E402

FALSE_PER_FRAME = 0.1
N_RESAMPLES = 1000
LOWEST = -4.0
OTHERS = ("floor found, who is cut by the image too", "floor known", "no floor", "template (floor known)")


class Run:
    """What a way of finding gave on all frames."""

    def __init__(self, name):
        self.name, self.verdicts, self.scores, self.rooms = name, [], [], []

    def add(self, frame, truths, people):
        """Counts a frame."""
        self.verdicts.append(judge_axes(truths, [one.axis for one in people], frame.T_world_camera))
        self.scores.append(np.array([one.score for one in people]))
        self.rooms.append(frame.info.room_id)

    def summary(self, bound):
        """Prints recall with its interval; rooms are drawn anew, since frames share them."""
        recall, _ = recall_at(self.verdicts, self.scores, FALSE_PER_FRAME)
        rooms = sorted(set(self.rooms))
        of_room = [[i for i, room in enumerate(self.rooms) if room == name] for name in rooms]
        rng = np.random.default_rng(0)
        recalls = []
        for _ in range(N_RESAMPLES):
            chosen = [i for k in rng.integers(0, len(rooms), len(rooms)) for i in of_room[k]]
            picked = [self.verdicts[i] for i in chosen], [self.scores[i] for i in chosen]
            recalls.append(recall_at(*picked, FALSE_PER_FRAME)[0])
        low, high = np.percentile(recalls, [2.5, 97.5])
        n_false = sum(
            int((v.is_false & (s >= bound)).sum()) for v, s in zip(self.verdicts, self.scores, strict=True)
        )
        n_true = sum(
            int((v.is_true & (s >= bound)).sum()) for v, s in zip(self.verdicts, self.scores, strict=True)
        )
        n_wanted = sum(v.n_wanted for v in self.verdicts)
        print(
            f"{self.name:44} recall {recall:.3f} [{low:.3f}, {high:.3f}] at {FALSE_PER_FRAME} false a frame; at the "
            f"shipped score {n_true / max(1, n_wanted):.3f} at {n_false / len(self.verdicts):.3f}",
            flush=True,
        )


def cpu_ms(call):
    start = time.thread_time()
    call()
    return 1000 * (time.thread_time() - start)


def overlaps(frame, verdict, people):
    """Of each true find the overlap of its box with that of the person's seen pixels."""
    for one, k, is_true in zip(people, verdict.person, verdict.is_true, strict=True):
        if is_true:
            rows, columns = np.nonzero(frame.person == k + 1)
            a, b = one.box, (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
            inner = max(0, min(a[2], b[2]) - max(a[0], b[0])) * max(0, min(a[3], b[3]) - max(a[1], b[1]))
            yield inner / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - inner)


def of_corpus(options):
    corpus = Corpus.open(options.corpus, allow_incomplete=True)
    model = read_finder(options.model)
    finder = PeopleFinder(model)
    indices = corpus.indices[: options.frames]
    for sensor in options.sensor:
        names = ("floor found", *OTHERS)
        runs = {name: Run(f"{sensor}: {name}") for name in names}
        times, ious, wanted, reached, n_floors = {}, [], Counter(), Counter(), 0
        for number, index in enumerate(indices):
            frame = corpus.scene(int(index))
            depth = corpus.arrays("depth", [index], sensor)[0]
            truths, floor = truths_of(frame), floor_of(frame)
            found = finder.find(depth, frame.camera, None, LOWEST)
            n_floors += found.floor is not None
            runs["floor found"].add(frame, truths, found.people)
            is_near = (truths.distance >= DISTANCES[0]) & (truths.distance <= DISTANCES[1])
            literal = replace(truths, is_wanted=is_near & (truths.shown >= MIN_VISIBLE))
            runs[OTHERS[0]].add(frame, literal, found.people)
            runs["floor known"].add(frame, truths, finder.find(depth, frame.camera, floor, LOWEST).people)
            view = view_of(depth, frame.camera, None)
            tops = contour(view)
            blind = finder.best(view, tops, tree_scores(view, tops, model.trees), None, LOWEST)
            runs["no floor"].add(frame, truths, blind)
            view = view_of(depth, frame.camera, floor)
            tops = contour(view)
            plain = finder.best(view, tops, template_scores(view, tops, model.template), floor, LOWEST)
            runs["template (floor known)"].add(frame, truths, plain)
            shown = finder.find(depth, frame.camera)
            verdict = judge_axes(truths, [one.axis for one in shown], frame.T_world_camera)
            ious += overlaps(frame, verdict, shown)
            is_found = np.isin(np.arange(len(truths.is_wanted)), verdict.person)
            for k in np.flatnonzero(truths.is_wanted):
                low = math.floor(4 * min(truths.visible[k], 0.99)) / 4
                wanted[low] += 1
                reached[low] += bool(is_found[k])
            for name, call in (
                ("floor found", lambda d=depth, c=frame.camera: finder.find(d, c)),
                ("floor known", lambda d=depth, c=frame.camera, f=floor: finder.find(d, c, f)),
            ):
                times.setdefault(name, []).append(min(cpu_ms(call) for _ in range(3)))
            if options.pictures and number % options.every == 0:
                picture = found_picture(depth, shown, verdict.is_false)
                for k in np.flatnonzero(truths.is_wanted & ~is_found):
                    u, v = (round(float(value)) for value in frame.joints_2d(k)[1])
                    cv2.drawMarker(picture, (u, v), (0, 94, 213), cv2.MARKER_TILTED_CROSS, 12, 2)
                write_picture(options.pictures / f"{sensor}-{number:04d}.png", picture)
        n_wanted = sum(v.n_wanted for v in runs["floor found"].verdicts)
        print(f"{len(indices)} frames, {n_wanted} people to be found; a floor is found in {n_floors}")
        for run in runs.values():
            run.summary(model.score)
        print(f"person box against seen pixels: overlap {np.median(ious):.2f} in the median")
        shares = ", ".join(f"from {low:.2f} {reached[low]} of {n}" for low, n in sorted(wanted.items()))
        print(f"found at the shipped score by the visible share: {shares}")
        for name, values in times.items():
            print(f"{name}: {1000 / np.mean(values):.0f} frames/s on one core ({np.mean(values):.2f} ms)")


def of_floors(options):
    corpus = Corpus.open(options.corpus, allow_incomplete=True)
    indices = corpus.indices[: options.frames]
    for sensor in options.sensor:
        angles, lifts, unseen = [], [], []
        for index in indices:
            frame, depth = corpus.scene(int(index)), corpus.arrays("depth", [index], sensor)[0]
            true = floor_of(frame)
            share = float(((frame.occluder == SCENE_CODE["floor"]) & (depth > 0)).mean())
            try:
                found = find_floor(depth, frame.camera)
            except NoFloorError:
                unseen.append(share)
                continue
            angles.append(math.degrees(math.acos(min(1.0, float(found.normal @ true.normal)))))
            lifts.append(1000 * abs(found.height - true.height))
        print(f"{sensor}: a floor is found in {len(angles)} of {len(indices)} frames;", end=" ")
        if unseen:
            print(
                f"of the others floor covers at most {max(unseen):.1%}, {np.median(unseen):.1%} in the median;",
                end=" ",
            )
        for name, values, unit in (("tilt", angles, "degrees"), ("height", lifts, "mm")):
            print(
                f"{name} off by {np.median(values):.2f} {unit} (95 %: {np.percentile(values, 95):.2f})", end="; "
            )
        print(f"off by over 3 degrees or 10 cm: {int(((np.array(angles) > 3) | (np.array(lifts) > 100)).sum())}")


def of_image(options):
    depth = cv2.imread(str(options.image), cv2.IMREAD_UNCHANGED)
    camera = Intrinsics(*options.camera)
    finder = PeopleFinder(read_finder(options.model))
    found = finder.find(depth, camera, FloorPrior())
    print(f"floor: {found.floor}")
    for one in finder.find(depth, camera, found.floor, min(LOWEST, finder.model.score)):
        kept = "found" if one.score >= finder.model.score else "below the score"
        print(
            f"{kept}: confidence {one.confidence:.3f}, {one.distance:.2f} m, place {np.round(one.place, 2)}, "
            f"height {one.height:.2f} m, box {[round(edge) for edge in one.box]}"
        )
    if options.pictures:
        write_picture(options.pictures / "image.png", found_picture(depth, found))
    times = [cpu_ms(lambda: finder.find(depth, camera, found.floor)) for _ in range(20)]
    print(f"{depth.shape[1]}x{depth.shape[0]}, floor known: {np.median(times):.2f} ms", end="; ")
    print(f"floor alone {np.median([cpu_ms(lambda: find_floor(depth, camera)) for _ in range(20)]):.2f} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("corpus", type=Path, nargs="?")
    parser.add_argument("--image", type=Path)
    parser.add_argument("--camera", type=float, nargs=4, default=(525, 525, 319.5, 239.5))
    parser.add_argument("--model", type=Path, default=SHIPPED)
    parser.add_argument("--frames", type=int, default=256)
    parser.add_argument("--sensor", nargs="+", default=["kinect_v2"])
    parser.add_argument("--floors", action="store_true")
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--every", type=int, default=8)
    options = parser.parse_args()
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    if options.image:
        of_image(options)
    elif options.floors:
        of_floors(options)
    else:
        of_corpus(options)


if __name__ == "__main__":
    main()
