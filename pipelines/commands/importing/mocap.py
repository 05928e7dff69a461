"""undergrowth import mocap: a pose library out of BVH motion capture."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.importing.mocap import MocapOptions, import_mocap, read_mapping
from pipelines.importing.splits import SplitRule
from pipelines.importing.subjects import SubjectFrom
from pipelines.targets import check_file
from storage.ranges import MAX_SEED, check_fields
from synth.bodies.poses.library import PoseLibrary, read_library, write_library
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MocapSettings:
    """Makes a library of poses from BVH files.

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

    def __post_init__(self) -> None:
        check_fields(self, {"seed": (0, MAX_SEED)})

    def run(self) -> int:
        """Imports, tells what became of every file."""
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
        custom = None if self.mapping is None else read_mapping(self.mapping)
        splits = SplitRule(self.train, self.val, self.test, self.seed)
        options = MocapOptions(splits, custom, self.distance, self.subject_from)
        return import_mocap(self.folder, options)
