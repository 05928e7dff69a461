"""undergrowth import mocap: a pose library out of BVH motion capture."""

import hashlib
import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from pipelines.errors import UserError
from pipelines.settings import read_toml
from synth.bodies.mocap.bvh import Bvh, MocapError, parse_bvh
from synth.bodies.mocap.ground import Support, find_support
from synth.bodies.mocap.retarget import Retargeted, retarget
from synth.bodies.mocap.roles import Convention
from synth.bodies.mocap.select import joint_places, unlike_poses
from synth.bodies.mocap.source import read_source
from synth.bodies.poses.draw import seat_height_of
from synth.bodies.poses.library import (
    FOOT_DOWN,
    FOOT_FLAT,
    FOOT_UP,
    PoseLibrary,
    Trial,
    joined,
    write_library,
)
from synth.bodies.poses.place import place_pose
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)

SHARES: dict[str, float] = {"train": 0.7, "val": 0.1, "test": 0.2}
"""How subjects that no list names are dealt to the splits."""
FRAMES_A_SECOND = 30.0
"""Of faster recordings, every second, third, ... frame is looked at."""
AVERAGE = BodySpec(1.70, 68.0, 0.5, 35.0)
"""A pose that cannot be put on this body is dropped."""


@dataclass(frozen=True)
class MocapSettings:
    """Makes a pose library out of BVH files; files that cannot be used are listed, the others imported.

    Attributes:
        folder: Where the .bvh files are, at any depth.
        out: File of the library.
        mapping: TOML file with a table [joints] of role = "joint name", for files with names of their own.
        distance: Poses of one subject in which no joint differs by more than this are dropped but for one [m].
        train: Subjects, or patterns such as '0*', that belong to this split.
        val: Likewise.
        test: Likewise; '*' puts all into the test split.
        seed: Deals out the subjects that no list names.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path
    mapping: Path | None = None
    distance: float = 0.06
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    seed: int = 0

    def run(self) -> int:
        """Imports, tells what became of every file."""
        library = import_mocap(self)
        write_library(self.out, library)
        for split in SPLITS:
            n_standing, n_sitting = (len(library.rows(split, is_sitting)) for is_sitting in (False, True))
            subjects = sorted({trial.subject for trial in library.trials if trial.split == split})
            log.info(
                "%-5s %5d standing %5d sitting, subjects %s", split, n_standing, n_sitting, " ".join(subjects)
            )
        for split in sorted(set(SPLITS) - {trial.split for trial in library.trials}):
            log.warning("no subject was dealt to %s; name some with --%s", split, split)
        log.info("%d poses in %s, digest %s", len(library), self.out, library.digest[:16])
        return 0

    def given_splits(self) -> dict[str, str]:
        """Split by subject, as the lists say."""
        given: dict[str, str] = {}
        for split in SPLITS:
            for subject in getattr(self, split):
                if given.setdefault(subject, split) != split:
                    raise UserError(f"subject {subject} is listed for {given[subject]} and for {split}")
        return given


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


def import_mocap(settings: MocapSettings) -> PoseLibrary:
    """Reads all files and keeps the poses that differ and fit an average body.

    Args:
        settings: What to import.

    Raises:
        UserError: There is no file, or none can be used.
    """
    if not settings.distance >= 0.0:
        raise UserError(f"distance={settings.distance} must not be negative")
    given = settings.given_splits()
    custom = None if settings.mapping is None else read_mapping(settings.mapping)
    if not settings.folder.is_dir():
        raise UserError(f"{settings.folder} is no folder")
    files = sorted(path for path in settings.folder.rglob("*") if path.suffix.lower() == ".bvh")
    if not files:
        raise UserError(f"{settings.folder} has no .bvh files")
    recordings: list[Recording] = []
    refused: list[str] = []
    for path in tqdm(files, unit="file", delay=2.0, dynamic_ncols=True):
        try:
            recordings.append(_read(path, recordings, custom, given, settings))
        except (MocapError, OSError, UnicodeDecodeError) as error:
            refused.append(f"refused: {path} {error}")
    for line in refused:
        log.warning("%s", line)
    if not recordings:
        raise UserError(f"none of the {len(files)} .bvh files in {settings.folder} can be used")
    library = _library(recordings, settings)
    if not len(library):
        raise UserError(f"no pose of the {len(recordings)} usable files in {settings.folder} is left to keep")
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


def split_of(subject: str, given: Mapping[str, str], seed: int) -> str:
    """The split that all of a subject's recordings belong to.

    Args:
        subject: Who.
        given: Split by subject or pattern, where it is fixed; a name goes before a pattern.
        seed: Deals out the others, each independently of who else there is.
    """
    if subject in given:
        return given[subject]
    for pattern, split in given.items():
        if fnmatchcase(subject, pattern):
            return split
    drawn = int.from_bytes(hashlib.sha256(f"{seed}/{subject}".encode()).digest()[:8], "big") / 2.0**64
    for split, share in SHARES.items():
        drawn -= share
        if drawn < 0.0:
            return split
    return SPLITS[-1]


def _read(
    path: Path,
    earlier: Sequence[Recording],
    custom: Convention | None,
    given: Mapping[str, str],
    settings: MocapSettings,
) -> Recording:
    name, subject = trial_and_subject(path)
    for recording in earlier:
        if recording.trial.name == name:
            raise MocapError(f"is trial {name} again, which {recording.trial.file} gave already")
    bvh = parse_bvh(path.read_text(encoding="utf-8-sig"))
    n_frames = len(bvh.values) + bvh.n_broken
    if n_frames < bvh.n_promised:
        log.warning("%s was cut: it has %d of %d frames", path, n_frames, bvh.n_promised)
    if bvh.n_broken:
        log.warning("%s: NaN or infinity in %d of %d frames, which are dropped", path, bvh.n_broken, n_frames)
    taken = _thinned(bvh)
    source = read_source(taken, custom)
    if not source.has_rest:
        log.info("%s has no T-pose: limb directions are taken from joint positions", path)
    poses, support = retarget(source), find_support(source, taken.frame_time)
    places = joint_places(poses)
    is_open = (support.is_standing | support.is_sitting) & ~source.is_t_pose
    rows = unlike_poses(places, is_open, settings.distance)
    trial = Trial(name, subject, split_of(subject, given, settings.seed), path.name)
    return Recording(
        _library_of(trial, poses, support, taken.frame, settings).taken(rows),
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
    trial: Trial, poses: Retargeted, support: Support, frame: NDArray[np.int64], settings: MocapSettings
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
        settings={"distance": settings.distance, "seed": settings.seed},
    )


def _library(recordings: Sequence[Recording], settings: MocapSettings) -> PoseLibrary:
    """Thins each subject's poses and drops those that fit no body; tells what became of each file."""
    whole = joined([recording.poses for recording in recordings])
    places = np.concatenate([recording.places for recording in recordings])
    subjects = np.array([trial.subject for trial in whole.trials])[whole.trial]
    unlike = []
    for subject in sorted(set(subjects)):
        rows = np.flatnonzero(subjects == subject)
        unlike.append(rows[unlike_poses(places[rows], np.ones(len(rows), np.bool_), settings.distance)])
    kept = np.sort(np.concatenate([*unlike, np.empty(0, np.int64)]))
    fitting = kept[_fits(whole, kept)]
    n_kept, n_fitting = (np.bincount(whole.trial[rows], minlength=len(recordings)) for rows in (kept, fitting))
    for k, recording in enumerate(recordings):
        log.info(
            "%-5s %-24s %5d frames, %3d T-poses, %4d on no support, %4d alike, %3d do not fit, %4d kept",
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
    for k, row in enumerate(tqdm(rows, unit="pose", delay=2.0, dynamic_ncols=True)):
        height = seat if library.is_sitting[row] else None
        out[k] = place_pose(library, int(row), body, np.random.default_rng(0), height) is not None
    return out
