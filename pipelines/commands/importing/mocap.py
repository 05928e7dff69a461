"""undergrowth import mocap: a library of poses, or of whole motions, out of BVH motion capture."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.importing.mocap import MocapOptions, import_mocap, read_mapping
from pipelines.importing.motions import import_motions
from pipelines.importing.splits import SplitRule
from pipelines.importing.subjects import SubjectFrom
from pipelines.targets import check_file
from storage.ranges import MAX_SEED, check_fields
from synth.bodies.motion.library import read_motions, write_motions
from synth.bodies.poses.library import PoseLibrary, read_library, write_library
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MocapSettings:
    """Makes a library of poses, or of motions for clips, from BVH files.

    Files that cannot be used are listed with the reason, and the others are imported.

    Attributes:
        folder: Folder of the .bvh files, which may lie in subfolders.
        out: File of the library.
        mapping: TOML file with a table [joints] of role = "joint name", for files that follow no known naming
            convention.
        distance: Poses of one subject count as duplicates, and only one is kept, if no joint is farther apart than
            this [m].
        subject_from: What tells whose recording a file is. 'folder' takes the folder; 'name' takes what the file's
            name begins with, after any date; 'auto' takes the first number of names such as '02_06_any.bvh', and
            else the folder.
        train: Subjects, or patterns such as '0*', for the train split.
        val: Subjects or patterns for the val split.
        test: Subjects or patterns for the test split; '*' puts all subjects there.
        seed: Seed that distributes the subjects that no list names.
        overwrite: Replace an existing library.
        clips: Keep whole motions with their frames in order, for clips, instead of single poses.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path
    mapping: Path | None = None
    distance: float = 0.06
    subject_from: SubjectFrom = "auto"
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    seed: int = 0
    overwrite: bool = False
    clips: bool = False

    def __post_init__(self) -> None:
        check_fields(self, {"seed": (0, MAX_SEED)})

    def run(self) -> int:
        """Imports, tells what became of every file."""
        if self.clips:
            return self._import_clips()
        check_file(self.out, read_library, self.overwrite)
        library = self.library()
        write_library(self.out, library)
        for split in SPLITS:
            n_standing, n_sitting = (len(library.rows(split, is_sitting)) for is_sitting in (False, True))
            subjects = sorted({trial.subject for trial in library.trials if trial.split == split})
            log.info(
                "%-5s %5d standing %5d sitting, subjects %s", split, n_standing, n_sitting, " ".join(subjects)
            )
        for split in sorted(set(SPLITS) - {trial.split for trial in library.trials}):
            log.warning("the split %s has no subject; name some with --%s", split, split)
        log.info("%d poses in %s, digest %s", len(library), self.out, library.digest[:16])
        return 0

    def library(self) -> PoseLibrary:
        """The library, not written yet.

        Raises:
            UserError: There is no file, or none can be used.
        """
        return import_mocap(self.folder, self._options())

    def _options(self) -> MocapOptions:
        custom = None if self.mapping is None else read_mapping(self.mapping)
        splits = SplitRule(self.train, self.val, self.test, self.seed)
        return MocapOptions(splits, custom, self.distance, self.subject_from)

    def _import_clips(self) -> int:
        check_file(self.out, read_motions, self.overwrite)
        library = import_motions(self.folder, self._options())
        write_motions(self.out, library)
        for split in SPLITS:
            own = library.seconds[library.of_split(split)]
            log.info(
                "%-5s %3d motions, %6.1f s, the longest %.1f s", split, len(own), own.sum(), own.max(initial=0.0)
            )
            if not len(own):
                log.warning("the split %s has no motion; name subjects with --%s", split, split)
        log.info("%d motions in %s, digest %s", len(library), self.out, library.digest[:16])
        return 0
