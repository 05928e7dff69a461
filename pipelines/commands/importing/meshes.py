"""undergrowth import meshes: an object library out of mesh files and URDFs."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from pipelines.importing.index import read_index
from pipelines.importing.meshes import MeshOptions, import_meshes
from pipelines.importing.splits import SplitRule
from pipelines.targets import check_file
from storage.ranges import MAX_SEED, check_fields
from synth.occluders.imported.sizes import Hints
from synth.occluders.meshlib import MeshLibrary, read_library, write_library
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MeshSettings:
    """Makes a library of objects from mesh files.

    Files that cannot be used are listed with the reason, and the others are imported. Models are called by their
    paths in the folder. Meshes that a URDF names are its parts.

    Attributes:
        folder: Folder of the files, which may lie in subfolders: OBJ, GLB, GLTF, PLY, STL, DAE, URDF.
        out: File of the library.
        class_name: Class of the files for which neither the index nor the file name (table__round.obj) gives one.
        index: CSV file with a column file (paths in the folder) and any of the columns class, unit, up, forward,
            split. Empty cells are estimated from the mesh.
        unit: Unit of the files for which the index gives none.
        up: Axis that points up in the files for which the index gives none.
        forward: Axis along which the user of the object looks (a sitter or a typist), for the files for which the
            index gives none.
        train: Names of models, or patterns such as 'kitchen*', for the train split.
        val: Names or patterns for the val split.
        test: Names or patterns for the test split; '*' puts all models there.
        outside_meshes: Read also what URDF and glTF files name outside the folder; by default such files are refused.
        seed: Seed that distributes the models that no list names, and sets the joints of URDF files.
        overwrite: Replace an existing library.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path
    class_name: Annotated[str | None, tyro.conf.arg(name="class")] = None
    index: Path | None = None
    unit: Literal["m", "cm", "mm", "inch"] | None = None
    up: Literal["x", "y", "z"] | None = None
    forward: Literal["x", "-x", "y", "-y", "z", "-z"] | None = None
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    outside_meshes: bool = False
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
            names = [f"{model.class_name}/{model.name}" for model in library.of(split)]
            log.info("%-5s %3d models: %s", split, len(names), ", ".join(names) or "none")
        log.info("%d models in %s, digest %s", len(library.models), self.out, library.digest[:16])
        return 0

    def library(self) -> MeshLibrary:
        """The library, not written yet.

        Raises:
            UserError: There is no file, none can be used, or a class or an index is wrong.
        """
        options = MeshOptions(
            SplitRule(self.train, self.val, self.test, self.seed),
            self.class_name,
            None if self.index is None else read_index(self.index),
            Hints(self.unit, self.up, self.forward),
            self.outside_meshes,
        )
        return import_meshes(self.folder, options)
