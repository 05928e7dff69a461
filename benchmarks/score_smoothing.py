"""Smoothing on clips, whose people also hide: error, jitter and lag of single answers and of smoothed ones.

undergrowth generate out/clips --config examples/clips.toml
python benchmarks/score_smoothing.py out/clips --model FILE [--split test] [--sensor kinect_v2] [--answers FILE]

Everybody is followed by their true identity; who ought not to be found in a frame (farther than 5 m, or less than a
quarter visible) has no answer there. A second table leaves all answers out for 0.5 to 2 s at a time.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from forests.calibration import WITHIN_M  # noqa: E402
from forests.smoothing import SkeletonSmoother, SmoothingConfig  # noqa: E402
from pipelines.corpus import Corpus  # noqa: E402
from pipelines.corpus.rooms.clips import clips_of  # noqa: E402
from pipelines.corpus.rooms.views import PeopleFrames, people_of  # noqa: E402
from pipelines.metrics.truths import truths_of_frames  # noqa: E402
from pipelines.models.asking import predict_frames  # noqa: E402
from pipelines.models.opening import open_model  # noqa: E402
from pipelines.progress import Progress  # noqa: E402
from synth.vocabulary import JOINT_NAMES  # noqa: E402

N_RESAMPLES = 2000
FORGOTTEN_S = 0.5
"""As `undergrowth predict --smooth` has it [s]."""
HIDDEN_S = (0.5, 2.0)
MOVING = 0.3
"""Lag is measured on joints faster than this [m/s]."""
SIMULATED = {"away": 0.04, "wild": 0.06, "wild_away": 0.4, "memory_s": 0.4}
"""Simulated answers: errors with a standard deviation of 4 cm along each axis that last 0.4 s, and 6 % of 40 cm."""


class Track:
    """One person of a clip over time: truths and answers, camera frame; NaN and 0 where there is no answer."""

    def __init__(self, true, speed, poses, fps):
        self.true, self.speed, self.poses, self.fps = true, speed, poses, fps
        self.found = np.full(true.shape, np.nan)
        self.trust = np.zeros(true.shape[:2])


def tracks_of(corpus, split):
    """Everybody of every clip, by (clip, person), and the place of each frame number."""
    tracks, places = {}, {}
    for clip in clips_of(corpus, split):
        joints, n_people = clip.array("joints").astype(float), int(clip.array("n_people")[0])
        poses = clip.array("T_world_camera")
        speed = np.einsum("tab,tkja->tkjb", poses[:, :3, :3], clip.array("joint_velocity").astype(float))
        for k in range(n_people):
            tracks[clip.number, k] = Track(joints[:, k], speed[:, k], poses, clip.fps)
        places |= {int(number): (clip.number, step) for step, number in enumerate(clip.numbers[:, 0])}
    return tracks, places


def ask(corpus, split, model, sensor):
    """(frame and person of each answer, joints, probabilities) of everybody who ought to be found."""
    contestant, _ = open_model(model)
    frames = PeopleFrames(corpus, people_of(corpus, corpus.split(split)), sensor)
    with Progress(len(frames), "person", "answers") as bar:
        results, _ = predict_frames(contestant, frames, truths_of_frames(frames), 1, bar.update)
    at = [JOINT_NAMES.index(name) for name in contestant.joints]
    found = np.full((len(frames), len(JOINT_NAMES), 3), np.nan)
    trust = np.zeros(found.shape[:2])
    found[:, at], trust[:, at] = results.proposals[:, :, 0], np.nan_to_num(results.probability, nan=1.0)
    return frames.people, found, trust


def simulate(tracks, rng):
    """Answers whose errors are as large and as lasting as said in `SIMULATED`, everywhere."""
    for track in tracks.values():
        keep = np.exp(-1.0 / (SIMULATED["memory_s"] * track.fps))
        off = np.zeros(track.true.shape)
        for step in range(len(off)):
            last = off[step - 1] if step else rng.normal(size=off.shape[1:])
            off[step] = keep * last + np.sqrt(1.0 - keep**2) * rng.normal(size=off.shape[1:])
        is_wild = rng.random(off.shape[:2]) < SIMULATED["wild"]
        wild = rng.normal(size=off.shape) * SIMULATED["wild_away"]
        track.found = track.true + np.where(is_wild[..., None], wild, SIMULATED["away"] * off)
        track.trust = np.where(is_wild, 0.4, 0.9) * np.ones(off.shape[:2])


def smoothed(track, config, in_world=True):
    """(n, 15, 3) what a smoother makes of a track, camera frame; nothing FORGOTTEN_S after the last answer."""
    out = np.full(track.found.shape, np.nan)
    smoother, unseen = SkeletonSmoother(config), np.full(track.found.shape[1], np.inf)
    for step, (found, trust) in enumerate(zip(track.found, track.trust, strict=True)):
        R, t = (track.poses[step, :3, :3], track.poses[step, :3, 3]) if in_world else (np.eye(3), np.zeros(3))
        is_found = np.isfinite(found).all(axis=1)
        unseen = np.where(is_found, 0.0, unseen + 1.0 / track.fps)
        if (unseen > FORGOTTEN_S).all():
            smoother.reset()
            continue
        places = smoother.update(found @ R.T + t, trust, 1.0 / track.fps).astype(float)
        out[step] = (places - t) @ R
        out[step, unseen > FORGOTTEN_S] = np.nan
    return out


def held(track):
    """(n, 15, 3) the last answer, for FORGOTTEN_S."""
    out = track.found.copy()
    n = round(FORGOTTEN_S * track.fps)
    since = np.zeros(out.shape[1], int)
    for step in range(1, len(out)):
        is_missing = np.isnan(track.found[step]).any(axis=1)
        since = np.where(is_missing, since + 1, 0)
        is_held = is_missing & (since <= n)
        out[step, is_held] = out[step - 1, is_held]
    return out


def hide(tracks, rng):
    """Leaves answers out for HIDDEN_S at a time, every 2 to 4 s; the steps that are left out, by track."""
    left_out = {}
    for key, track in tracks.items():
        n = len(track.found)
        is_out, step = np.zeros(n, bool), int(rng.uniform(1.0, 3.0) * track.fps)
        while step < n:
            end = step + int(rng.uniform(*HIDDEN_S) * track.fps)
            is_out[step:end] = np.isfinite(track.found[step - 1]).any()
            step = end + int(rng.uniform(2.0, 4.0) * track.fps)
        left_out[key] = is_out
        track.found[is_out], track.trust[is_out] = np.nan, 0.0
    return left_out


class Sums:
    """Ratios of sums over clips, with 95 % intervals from resamples of the clips."""

    def __init__(self, clips):
        self.clips, self.row = np.unique(clips, return_inverse=True)
        rng = np.random.default_rng(0)
        n = len(self.clips)
        self.weights = np.stack([np.bincount(rng.integers(0, n, n), minlength=n) for _ in range(N_RESAMPLES)])

    def ratio(self, top, bottom, unit=1.0):
        """Sum of (n_tracks,) over sum of (n_tracks,), and its interval."""
        a, b = (np.bincount(self.row, values, minlength=len(self.clips)) for values in (top, bottom))
        low, high = np.percentile((self.weights @ a) / np.maximum(self.weights @ b, 1e-9), [2.5, 97.5])
        return f"{unit * a.sum() / max(b.sum(), 1e-9):5.1f} [{unit * low:.1f}, {unit * high:.1f}]"


def total(parts):
    return np.array([part.sum() for part in parts], float)


def report(name, tracks, answers, chosen, sums):
    """A line: share within 10 cm of the joints chosen, mean error of those answered, jitter and lag.

    Args:
        name: Of the method.
        tracks: By (clip, person).
        answers: (n, 15, 3) of each track.
        chosen: (n, 15) bool of each track: which joints of which steps count.
        sums: Of the tracks.
    """
    off = {key: answers[key] - track.true for key, track in tracks.items()}
    error = {key: np.linalg.norm(values, axis=-1) for key, values in off.items()}
    is_told = {key: np.isfinite(error[key]) & chosen[key] for key in tracks}
    near = total((error[key] <= WITHIN_M) & is_told[key] for key in tracks)
    words = [sums.ratio(near, total(chosen.values()), 100.0)]
    words.append(sums.ratio(total(error[key][is_told[key]] for key in tracks), total(is_told.values()), 100.0))
    bend = {key: np.linalg.norm(np.diff(values, 2, axis=0), axis=-1) for key, values in off.items()}
    is_bend = {key: np.isfinite(bend[key]) & is_told[key][1:-1] for key in tracks}
    words.append(sums.ratio(total(bend[key][is_bend[key]] for key in tracks), total(is_bend.values()), 1000.0))
    along, square = [], []
    for key, track in tracks.items():
        is_fast = is_told[key] & (np.linalg.norm(track.speed, axis=-1) > MOVING) & (error[key] < 0.25)
        along.append(-(off[key] * track.speed)[is_fast])
        square.append((track.speed**2)[is_fast])
    words.append(sums.ratio(total(along), total(square), 1000.0))
    print(f"{name:34} " + " ".join(f"{word:>20}" for word in words))


METHODS = {
    "default": SmoothingConfig(),
    "speed kept": SmoothingConfig(fading_s=1e6),
    "noise 1 cm": SmoothingConfig(noise_m=0.01),
    "noise 6 cm": SmoothingConfig(noise_m=0.06),
    "acceleration 10 m/s2": SmoothingConfig(acceleration=10.0),
    "acceleration 2 m/s2": SmoothingConfig(acceleration=2.0),
}


def table(title, tracks, chosen, methods):
    sums = Sums(np.array([clip for clip, _ in tracks]))
    n_joints, n_steps = int(total(chosen.values()).sum()), sum(map(len, chosen.values()))
    print(
        f"\n{title}: {len(tracks)} people of {len(sums.clips)} clips, {n_steps} frames of them, {n_joints} joints"
    )
    heads = ("within 10 cm [%]", "mean error [cm]", "jitter [mm]", "lag [ms]")
    print(f"{'':34} " + " ".join(f"{head:>20}" for head in heads))
    report("as they come", tracks, {key: track.found for key, track in tracks.items()}, chosen, sums)
    for name, method in methods.items():
        report(name, tracks, {key: method(track) for key, track in tracks.items()}, chosen, sums)


def tables(name, tracks):
    """The table of people who are seen, and that of people of whom answers are left out."""
    by_config = {label: (lambda track, c=c: smoothed(track, c)) for label, c in METHODS.items()}
    by_config["default, camera's frame"] = lambda track: smoothed(track, SmoothingConfig(), False)
    seen = {key: np.isfinite(track.found).all(axis=-1) for key, track in tracks.items()}
    table(f"{name}, where there is an answer", tracks, seen, by_config)
    left_out = hide(tracks, np.random.default_rng(1))
    n = round(FORGOTTEN_S * next(iter(tracks.values())).fps)
    for first, last in ((0, n // 2), (n // 2, n)):
        inside = {key: _since(is_out, first, last)[:, None] & seen[key] for key, is_out in left_out.items()}
        times = f"{first / 2 / n:.2f} to {last / 2 / n:.2f} s"
        table(f"{name}, hidden for {times}", tracks, inside, {"held": held, **by_config})
    after = {key: _after(is_out, n)[:, None] & seen[key] for key, is_out in left_out.items()}
    table(f"{name}, the first 0.5 s after being hidden", tracks, after, by_config)


def _since(is_out, first, last):
    """(n,) bool: steps that have been left out for more than `first` and at most `last` steps."""
    since = np.zeros(len(is_out), int)
    for step in range(len(is_out)):
        since[step] = since[step - 1] + 1 if is_out[step] else 0
    return (since > first) & (since <= last)


def _after(is_out, n):
    """(n,) bool: the first steps after any that were left out."""
    since = np.full(len(is_out), n)
    for step in range(1, len(is_out)):
        since[step] = n if is_out[step] else 0 if is_out[step - 1] else since[step - 1] + 1
    return since < n


def natural(tracks):
    """Prints how long people of the clips have no answer between two that they have."""
    lasting = []
    for track in tracks.values():
        has = np.flatnonzero(np.isfinite(track.found).any(axis=(1, 2)))
        lasting += [gap / track.fps for gap in np.diff(has) - 1 if gap > 0]
    lasting = np.array(lasting)
    inside = ((lasting >= HIDDEN_S[0]) & (lasting <= HIDDEN_S[1])).sum()
    print(f"{len(lasting)} gaps between answers, {inside} of 0.5 to 2 s, longest {lasting.max(initial=0.0):.1f} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--model", type=Path, help="without one, answers are simulated")
    parser.add_argument("--split", default="test")
    parser.add_argument("--sensor")
    parser.add_argument("--answers", type=Path, help="where the model's answers are kept, to be used again")
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    tracks, places = tracks_of(corpus, options.split)
    if options.model is None:
        simulate(tracks, np.random.default_rng(0))
        tables("simulated answers", tracks)
        return
    if options.answers is not None and options.answers.exists():
        people, found, trust = np.load(options.answers).values()
    else:
        people, found, trust = ask(corpus, options.split, options.model, options.sensor)
        if options.answers is not None:
            np.savez(options.answers, people=people, found=found, trust=trust)
    for (number, k), joints, sure in zip(people.tolist(), found, trust, strict=True):
        clip, step = places[number]
        tracks[clip, k].found[step], tracks[clip, k].trust[step] = joints, sure
    natural(tracks)
    tables(options.model.stem, tracks)


if __name__ == "__main__":
    main()
