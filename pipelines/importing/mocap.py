"""A pose library out of BVH motion capture."""

import contextlib
import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.foreign import ForeignFileError, check_size, reading
from pipelines.importing.splits import SplitRule
from pipelines.importing.subjects import Named, SubjectFrom, numbers_in_folders, subjects_of
from pipelines.progress import progress
from pipelines.settings import read_toml
from synth.bodies.mocap.bvh import Bvh, parse_bvh
from synth.bodies.mocap.ground import Support, find_support
from synth.bodies.mocap.reach import limb_errors
from synth.bodies.mocap.retarget import Retargeted, retarget
from synth.bodies.mocap.roles import Convention
from synth.bodies.mocap.select import joint_places, unlike_poses
from synth.bodies.mocap.source import Source, read_source
from synth.bodies.mocap.text import MocapError, decode_bvh
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
MAX_MISS = np.radians(20.0)
"""A pose with a limb farther than this off the recording is dropped."""
BYTES_A_BYTE = 8
"""Memory that a byte of a BVH file takes while it is read."""
BYTES_A_JOINT = 500
"""Memory that a joint takes in a frame."""


@dataclass(frozen=True)
class MocapOptions:
    """How recordings become a library.

    Attributes:
        splits: Deals the subjects to the splits.
        custom: Names of joints, for files with names of their own.
        distance: Poses of one subject in which no joint differs by more than this are dropped but for one [m].
        subject_from: What tells whose recording a file is.
    """

    splits: SplitRule = field(default_factory=SplitRule)
    custom: Convention | None = None
    distance: float = 0.06
    subject_from: SubjectFrom = "auto"

    def __post_init__(self) -> None:
        if not 0.0 <= self.distance < math.inf:
            raise UserError(f"distance={self.distance} must be a length of at least 0 m")


class FrameCounts(NamedTuple):
    """What became of a recording's frames; each is counted once.

    Attributes:
        t_poses: They are T-poses.
        on_floor: Somebody lies, kneels, crawls or sits on the floor.
        unsupported: Nothing carries the person: in the air, climbing, or on the way to a seat.
        out_of_reach: A limb is more than `MAX_MISS` off, because our joint limits end before.
        open: The others, of which those that differ are kept.
    """

    t_poses: int
    on_floor: int
    unsupported: int
    out_of_reach: int
    open: int


@dataclass(frozen=True)
class Recording:
    """A file's poses that differ from each other.

    Attributes:
        poses: They, as a library of one recording.
        places: (n, 15, 3) joints of an average body in them [m].
        counts: What became of the frames that were looked at.
    """

    poses: PoseLibrary
    places: NDArray[np.float64]
    counts: FrameCounts

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
    recordings: list[Recording] = []

    def read(path: Path, trial: Trial) -> None:
        recordings.append(_read(path, trial, options))

    read_files(folder, options, read)
    library = _library(recordings, options.distance)
    if not len(library):
        raise UserError(f"no pose of the {len(recordings)} usable files in {folder} is left to keep")
    return library


def read_files(folder: Path, options: MocapOptions, read: Callable[[Path, Trial], None]) -> None:
    """Reads every BVH file of a folder; those that cannot be used are told at the end.

    Args:
        folder: Where the .bvh files are, at any depth.
        options: Whose recording is whose, and which split a subject belongs to.
        read: Reads one; a MocapError if it cannot be used.

    Raises:
        UserError: There is no file, or none can be used.
    """
    if not folder.is_dir():
        raise UserError(f"{folder} is not a folder")
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".bvh")
    if not files:
        raise UserError(f"{folder} has no .bvh files")
    refused: list[str] = []
    earlier: dict[str, Trial] = {}
    subjects = subjects_of(files, folder, options.subject_from)
    for number, folders in numbers_in_folders(subjects) if options.subject_from == "auto" else ():
        log.warning(
            "files that begin with %s are in the folders %s and are taken for one subject; if each folder is a person, "
            "say --subject-from folder", number, ", ".join(folders),
        )  # fmt: skip
    for path in progress(files, "file", "import mocap"):
        try:
            with reading_bvh(path):
                trial = _trial(path, subjects[path], earlier, options)
                read(path, trial)
                earlier[trial.name] = trial
        except ForeignFileError as error:
            refused.append(f"refused: {error}")
    for line in refused:
        log.warning("%s", line)
    if not earlier:
        raise UserError(f"none of the {len(files)} .bvh files in {folder} can be used")


def _trial(path: Path, names: Named | MocapError, earlier: Mapping[str, Trial], options: MocapOptions) -> Trial:
    """What a file is called and whose it is."""
    if isinstance(names, MocapError):
        raise names
    name, subject, _ = names
    if name in earlier:
        raise MocapError(f"is trial {name} again, which was already read from {earlier[name].file}")
    return Trial(name, subject, options.splits.split_of(subject), _printable(path.name))


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


@contextlib.contextmanager
def reading_bvh(path: Path) -> Iterator[None]:
    """Reads a BVH file inside; whatever is wrong with it becomes one sentence that names it.

    Raises:
        ForeignFileError: The file cannot be used.
    """
    with reading(path, "a BVH file"):
        try:
            yield
        except MocapError as error:
            raise ForeignFileError(f"{path} {error}") from None


def read_bvh(path: Path) -> Bvh:
    """Reads a BVH file of any encoding and tells what is odd about it.

    Raises:
        MocapError: It is none, or damaged.
        ForeignFileError: It is too large.
        OSError: It cannot be opened.
    """
    check_size(path, BYTES_A_BYTE * path.stat().st_size, "its text")
    bvh = parse_bvh(decode_bvh(path.read_bytes()))
    n_frames = len(bvh.values) + bvh.n_broken
    if n_frames < bvh.n_promised:
        log.warning("%s was cut off: it has %d of %d frames", path, n_frames, bvh.n_promised)
    elif n_frames > bvh.n_promised:
        log.warning("%s says Frames: %d but has %d; all are read", path, bvh.n_promised, n_frames)
    if bvh.n_left_over and n_frames >= bvh.n_promised:
        log.warning("%s has %d lines after its frames, which are not read", path, bvh.n_left_over)
    if bvh.n_broken:
        log.warning("%s: NaN or infinity in %d of %d frames, which are dropped", path, bvh.n_broken, n_frames)
    return bvh


def read_motion(path: Path, options: MocapOptions) -> tuple[Bvh, Source]:
    """A file at 30 frames a second or less, and the motion in it.

    Raises:
        MocapError: It cannot be used.
        ForeignFileError: It is too large.
    """
    taken = _thinned(read_bvh(path))
    n_joints, n_frames = len(taken.joints), len(taken.values)
    check_size(path, BYTES_A_JOINT * n_joints * n_frames, f"its {n_joints} joints in {n_frames} frames")
    source = read_source(taken, options.custom)
    if not source.has_rest:
        log.info("%s has no T-pose: limb directions are taken from joint positions", path)
    return taken, source


def _read(path: Path, trial: Trial, options: MocapOptions) -> Recording:
    taken, source = read_motion(path, options)
    poses, support = retarget(source), find_support(source, taken.frame_time)
    places = joint_places(poses)
    is_carried = support.is_standing | support.is_sitting
    is_near = limb_errors(source, poses).max(axis=(1, 2)) < MAX_MISS
    counts = _counts(source.is_t_pose, support.is_on_floor, ~is_carried, ~is_near)
    is_open = is_carried & is_near & ~source.is_t_pose
    rows = unlike_poses(places, is_open, options.distance)
    return Recording(_library_of(trial, poses, support, taken.frame, options).taken(rows), places[rows], counts)


def _counts(*reasons: NDArray[np.bool_]) -> FrameCounts:
    """Counts each frame under the first reason for which it is left out."""
    first = np.argmax(np.stack([*reasons, np.ones_like(reasons[0])]), axis=0)
    t_poses, on_floor, unsupported, out_of_reach, is_open = np.bincount(first, minlength=5).tolist()
    return FrameCounts(t_poses, on_floor, unsupported, out_of_reach, is_open)


def _printable(name: str) -> str:
    """A file's name without bytes that are no text."""
    return name.encode("utf-8", "backslashreplace").decode("utf-8")


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
        counts = recording.counts
        log.info(
            "%-5s %-24s %5d frames, %3d T-poses, %4d on the floor, %4d unsupported, %3d out of reach, "
            "%4d duplicates, %3d do not fit, %4d kept",
            recording.trial.split, recording.trial.file, sum(counts), counts.t_poses, counts.on_floor,
            counts.unsupported, counts.out_of_reach, counts.open - n_kept[k], n_kept[k] - n_fitting[k],
            n_fitting[k],
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
