"""Starts of random walks without a detector, and smoothing, on recorded frames: what each is worth.

    python benchmarks/bench_recorded.py --model walk.safetensors --recording DIR --corpus CORPUS

The folder needs joints. Starts are measured for random walk forests alone: one recorded frame in 28, and the split
val of the corpus, as the camera sees it and the person alone. Smoothing: three stretches of 5 s at 30 frames/s.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forests.boxes import BOX_MARGIN_M, Box, upper_body_box, upper_foreground_box
from forests.calibration import WITHIN_M
from forests.crops import foreground_box
from forests.rwf.start import start_point
from pipelines.corpus import Corpus
from pipelines.models.asking import Contestant, ask
from pipelines.models.opening import open_model
from pipelines.predicting.smooth import TrackSmoother
from pipelines.recordings.choosing import choose_layout
from pipelines.recordings.frames import Options, RecordedFrames
from synth.frame import Frame
from synth.vocabulary import JOINT_NAMES, JointState

FPS, STRETCH_S, N_STRETCHES = 30.0, 5.0, 3


def known(frame: Frame, names: tuple[str, ...]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """True joints of these names [m], and which of them are known."""
    at = [JOINT_NAMES.index(name) for name in names]
    return frame.joints[at], frame.joint_state[at] != JointState.UNKNOWN


def true_box(contestant: Contestant, frame: Frame) -> Box:
    """As a perfect detector gives it."""
    joints, is_known = known(frame, contestant.box_joints)
    return upper_body_box(joints[is_known], frame.camera, BOX_MARGIN_M)


def bench_starts(contestant: Contestant, name: str, frames: list[Frame]) -> None:
    """Prints how far off the walks start, and how many joints they find."""
    told = [start_point(frame.depth, frame.camera, box=true_box(contestant, frame)) for frame in frames]
    ways = {
        "true box": [true_box(contestant, frame) for frame in frames],
        "all of the foreground": [tuple(map(float, foreground_box(frame.depth))) for frame in frames],
        "upper body": [upper_foreground_box(frame.depth, frame.camera) for frame in frames],
    }
    for way, boxes in ways.items():
        off, right = [], []
        for frame, box, truth in zip(frames, boxes, told, strict=True):
            off.append(np.linalg.norm(start_point(frame.depth, frame.camera, box=box) - truth))
            joints, is_known = known(frame, contestant.joints)
            found = ask(contestant, frame.depth, frame.camera, box).joints
            right += (np.linalg.norm(found - joints, axis=1) <= WITHIN_M)[is_known].tolist()
        median, most = 100 * np.quantile(off, (0.5, 0.9))
        print(f"{name:28}{way:24}off {median:3.0f} ({most:3.0f}) cm, within 10 cm {100 * np.mean(right):.1f} %")


def bench_smoothing(contestant: Contestant, stretches: list[list[Frame]]) -> None:
    """Prints errors and jitter as the joints come and smoothed."""
    smoother = TrackSmoother(FPS)
    errors: dict[str, list] = {"as they come": [], "smoothed": []}
    jitter: dict[str, list] = {name: [] for name in errors}
    for number, frames in enumerate(stretches):
        answers = [ask(contestant, frame.depth, frame.camera) for frame in frames]
        smooth = [smoother.smoothed(str(number), tick, answer) for tick, answer in enumerate(answers)]
        truth = [known(frame, contestant.joints) for frame in frames]
        is_known = np.array([item[1] for item in truth])
        for name, estimates in zip(errors, (answers, smooth), strict=True):
            joints = np.array([estimate.joints for estimate in estimates])
            errors[name] += np.linalg.norm(joints - [item[0] for item in truth], axis=2)[is_known].tolist()
            jitter[name] += np.linalg.norm(np.diff(joints, 2, axis=0), axis=2)[is_known[2:]].tolist()
    for name, values in errors.items():
        found = np.array(values)
        print(
            f"{contestant.method:28}{name:24}within 10 cm {100 * np.mean(found <= WITHIN_M):.1f} %, mean "
            f"{100 * np.nanmean(found):.1f} cm, jitter {100 * np.nanmedian(jitter[name]):.1f} "
            f"({100 * np.nanmean(jitter[name]):.1f}) cm"
        )


def main() -> None:
    """Measures one model."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--recording", type=Path, required=True)
    parser.add_argument("--corpus", type=Path)
    options = parser.parse_args()
    contestant, _ = open_model(options.model)
    name, layout = choose_layout(options.recording, None)
    recording = RecordedFrames(options.recording, layout, Options(name, 0.02, True, 1, (0.0, 0.0, 1.0)))
    n = round(FPS * STRETCH_S)
    if contestant.box_joints:
        if options.corpus is not None:
            corpus = Corpus.open(options.corpus)
            scenes = [corpus.frame(int(k)) for k in corpus.split("val")]
            alone = [replace(frame, depth=frame.body_depth) for frame in scenes]
            bench_starts(contestant, "generated, person alone", alone)
            bench_starts(contestant, "generated, with objects", scenes)
        bench_starts(contestant, name, [recording.frame(k) for k in range(0, len(recording), 28)])
    begins = [k * len(recording) // N_STRETCHES for k in range(N_STRETCHES)]
    bench_smoothing(contestant, [[recording.frame(k) for k in range(b, b + n)] for b in begins])


if __name__ == "__main__":
    main()
