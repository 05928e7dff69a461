"""A pose library out of BVH motion capture."""

import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.importing.splits import SplitRule
from pipelines.progress import progress
from pipelines.settings import read_toml
from synth.bodies.mocap.bvh import Bvh, MocapError, parse_bvh
from synth.bodies.mocap.ground import Support, find_support
from synth.bodies.mocap.retarget import Retargeted, retarget
from synth.bodies.mocap.roles import Convention
from synth.bodies.mocap.select import joint_places, unlike_poses
from synth.bodies.mocap.source import read_source
from synth.bodies.poses.library import (
    FOOT_DOWN,
    FOOT_FLAT,
    FOOT_UP,
    PoseLibrary,
    Trial,
    joined,
)
from synth.bodies.poses.place import place_pose
from synth.bodies.poses.sit import seat_height_of
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec

log = logging.getLogger(__name__)

FRAMES_A_SECOND = 30.0
"""Of faster recordings, every second, third, ... frame is looked at."""
AVERAGE = BodySpec(1.70, 68.0, 0.5, 35.0)
"""A pose that cannot be put on this body is dropped."""


@dataclass(frozen=True)
class MocapOptions:
    """How recordings become a library.

    Attributes:
        splits: Deals the subjects to the splits.
        custom: Names of joints, for files with names of their own.
        distance: Poses of one subject in which no joint differs by more than this are dropped but for one [m].
    """

    splits: SplitRule = field(default_factory=SplitRule)
    custom: Convention | None = None
    distance: float = 0.06

    def __post_init__(self) -> None:
        if not self.distance >= 0.0:
            raise UserError(f"distance={self.distance} must not be negative")


@dataclass(frozen=True)
class Recording:
    """A file's poses that differ from each other.

    Attributes:
        poses: They, as a library of one recording.
        places: (n, 15, 3) joints of an average body in them [m].
        n_frames: Frames that were looked at.
        n_t_poses: Those that are T-poses.
        n_open: Those that stand or sit.
    """

    poses: PoseLibrary
    places: NDArray[np.float64]
    n_frames: int
    n_t_poses: int
    n_open: int

    @property
    def trial(self) -> Trial:
        """Where they come from."""
        return self.poses.trials[0]


def import_mocap(folder: Path, options: MocapOptions) -> PoseLibrary:
    """Reads all files and keeps the poses that differ and fit an average body.

    Args:
        folder: Where the .bvh files are, at any depth.
        options: How they become a library.

    Raises:
        UserError: There is no file, or none can be used.
    """
    if not folder.is_dir():
        raise UserError(f"{folder} is not a folder")
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".bvh")
    if not files:
        raise UserError(f"{folder} has no .bvh files")
    recordings: list[Recording] = []
    refused: list[str] = []
    for path in progress(files, "file", "import mocap"):
        try:
            recordings.append(_read(path, recordings, options))
        except (MocapError, OSError, UnicodeDecodeError) as error:
            refused.append(f"refused: {path} {error}")
    for line in refused:
        log.warning("%s", line)
    if not recordings:
        raise UserError(f"none of the {len(files)} .bvh files in {folder} can be used")
    library = _library(recordings, options.distance)
    if not len(library):
        raise UserError(f"no pose of the {len(recordings)} usable files in {folder} is left to keep")
    return library


def read_mapping(path: Path) -> Convention:
    """Joint names by role out of a TOML file's table [joints].

    Raises:
        UserError: Another table, an unknown role or a missing one.
    """
    given = read_toml(path)
    joints = given.get("joints")
    if set(given) != {"joints"} or not isinstance(joints, Mapping):
        raise UserError(f"{path} must have one table, [joints]; it has {', '.join(given) or 'nothing'}")
    wrong = [role for role, name in joints.items() if not isinstance(name, str)]
    if wrong:
        raise UserError(f"{path}.joints.{wrong[0]}={joints[wrong[0]]!r} must be the name of a joint")
    try:
        return Convention(path.stem, joints)
    except MocapError as error:
        raise UserError(f"{path}: {error}") from None


def trial_and_subject(path: Path) -> tuple[str, str]:
    """Names of a recording and its subject: "02_06" and "02" of 02_06_x.bvh; else by the folder."""
    numbered = re.match(r"(\d+)_(\d+)(?:_|$)", path.stem)
    if numbered:
        return f"{numbered[1]}_{numbered[2]}", numbered[1]
    subject = path.resolve().parent.name
    return f"{subject}_{path.stem}", subject


def _read(path: Path, earlier: Sequence[Recording], options: MocapOptions) -> Recording:
    name, subject = trial_and_subject(path)
    for recording in earlier:
        if recording.trial.name == name:
            raise MocapError(f"is trial {name} again, which was already read from {recording.trial.file}")
    bvh = parse_bvh(path.read_text(encoding="utf-8-sig"))
    n_frames = len(bvh.values) + bvh.n_broken
    if n_frames < bvh.n_promised:
        log.warning("%s was cut off: it has %d of %d frames", path, n_frames, bvh.n_promised)
    if bvh.n_broken:
        log.warning("%s: NaN or infinity in %d of %d frames, which are dropped", path, bvh.n_broken, n_frames)
    taken = _thinned(bvh)
    source = read_source(taken, options.custom)
    if not source.has_rest:
        log.info("%s has no T-pose: limb directions are taken from joint positions", path)
    poses, support = retarget(source), find_support(source, taken.frame_time)
    places = joint_places(poses)
    is_open = (support.is_standing | support.is_sitting) & ~source.is_t_pose
    rows = unlike_poses(places, is_open, options.distance)
    trial = Trial(name, subject, options.splits.split_of(subject), path.name)
    return Recording(
        _library_of(trial, poses, support, taken.frame, options).taken(rows),
        places[rows],
        len(is_open),
        int(source.is_t_pose.sum()),
        int(is_open.sum()),
    )


def _thinned(bvh: Bvh) -> Bvh:
    """Every second, third, ... frame of a fast recording; those left out are counted with."""
    step = max(1, round(1.0 / (FRAMES_A_SECOND * bvh.frame_time)))
    rows = np.flatnonzero(bvh.frame % step == 0)
    if not len(rows):
        raise MocapError(f"has NaN or infinity in every frame of {FRAMES_A_SECOND:.0f} a second")
    return replace(bvh, frame_time=step * bvh.frame_time, values=bvh.values[rows], frame=bvh.frame[rows])


def _library_of(
    trial: Trial, poses: Retargeted, support: Support, frame: NDArray[np.int64], options: MocapOptions
) -> PoseLibrary:
    n = len(poses.angles)
    feet = np.where(support.is_flat, FOOT_FLAT, np.where(support.is_down, FOOT_DOWN, FOOT_UP))
    return PoseLibrary(
        source="mocap",
        trials=(trial,),
        angles=poses.angles.astype(np.float32),
        root=poses.root.astype(np.float32),
        is_sitting=support.is_sitting,
        feet=feet.astype(np.uint8),
        trial=np.zeros(n, dtype=np.int32),
        frame=frame.astype(np.int32),
        settings={"distance": options.distance, "seed": options.splits.seed},
    )


def _library(recordings: Sequence[Recording], distance: float) -> PoseLibrary:
    """Thins each subject's poses and drops those that fit no body; tells what became of each file."""
    whole = joined([recording.poses for recording in recordings])
    places = np.concatenate([recording.places for recording in recordings])
    subjects = np.array([trial.subject for trial in whole.trials])[whole.trial]
    unlike = []
    for subject in sorted(set(subjects)):
        rows = np.flatnonzero(subjects == subject)
        unlike.append(rows[unlike_poses(places[rows], np.ones(len(rows), np.bool_), distance)])
    kept = np.sort(np.concatenate([*unlike, np.empty(0, np.int64)]))
    fitting = kept[_fits(whole, kept)]
    n_kept, n_fitting = (np.bincount(whole.trial[rows], minlength=len(recordings)) for rows in (kept, fitting))
    for k, recording in enumerate(recordings):
        log.info(
            "%-5s %-24s %5d frames, %3d T-poses, %4d unsupported, %4d duplicates, %3d do not fit, %4d kept",
            recording.trial.split, recording.trial.file, recording.n_frames, recording.n_t_poses,
            recording.n_frames - recording.n_open - recording.n_t_poses, recording.n_open - n_kept[k],
            n_kept[k] - n_fitting[k], n_fitting[k],
        )  # fmt: skip
    return whole.taken(fitting)


def _fits(library: PoseLibrary, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) whether each pose can be put on an average body."""
    body = make_body(AVERAGE)
    seat = seat_height_of(body)
    out = np.empty(len(rows), dtype=np.bool_)
    for k, row in enumerate(progress(rows, "pose", "import mocap")):
        height = seat if library.is_sitting[row] else None
        out[k] = place_pose(library, int(row), body, np.random.default_rng(0), height) is not None
    return out
