"""Files of other programs: samples, how each is damaged, and how the program reads it."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipelines.errors import UserError
from tools.fuzz import samples
from tools.fuzz.mutations import damaged_bytes, damaged_text
from tools.fuzz.workers import Format, digest

WHOLE = "whole"
"""Name of the undamaged file beside a damaged one."""


# Recorded depth


def _depth(suffix: str) -> Callable[[Path], Format]:
    def make(folder: Path) -> Format:
        from pipelines.predicting.images import recorded_requests

        path = samples.depth(folder, suffix)
        layout = str(folder / "layout.toml")

        def read(path: Path) -> object:
            return [digest(*request.read()) for request in recorded_requests([path], layout, None)]

        damage = damaged_text if suffix == "ascii.pcd" else damaged_bytes
        return Format(f"depth {suffix}", path, damage, read, (UserError,))

    return make


def _joints(folder: Path) -> Format:
    """The text file of joints beside a depth image, imported with it; another frame must survive."""
    from tests.pipelines.toy_recording import write_recording

    recording = write_recording(folder / "in", 3)
    layout = samples.toy_layout(folder)
    return Format("depth joints", recording / "j_6.txt", damaged_text, _importer(recording, layout), (UserError,))


def _frames(folder: Path) -> Format:
    """One damaged image of a folder that is imported; the other frames must survive."""
    from tests.pipelines.toy_recording import write_recording

    recording = write_recording(folder / "in", 3)
    layout = samples.toy_layout(folder)
    return Format("depth folder", recording / "d_6.png", damaged_bytes, _importer(recording, layout), (UserError,))


def _importer(recording: Path, layout: str) -> Callable[[Path], object]:
    from pipelines.commands.importing.depth import DepthSettings
    from pipelines.corpus import Corpus
    from pipelines.generation.writing import write_shown

    def read(path: Path) -> object:
        with tempfile.TemporaryDirectory(dir=recording.parent) as out:
            made = DepthSettings(recording, Path(out), layout).order()
            write_shown(Path(out), made[1] if isinstance(made, tuple) else made)
            n = len(Corpus.open(out))
            assert n >= 2, f"{n} frames of 3 are imported"
            return n

    return read


# Motion capture and meshes


def _bvh(folder: Path) -> Format:
    """A damaged recording beside a whole one, which must be imported."""
    from pipelines.commands.importing.mocap import MocapSettings

    path = samples.recordings(folder / "in")

    def read(path: Path) -> object:
        library = MocapSettings(path.parent, folder / "out", distance=0.0).library()
        names = {trial.file for trial in library.trials}
        assert any(WHOLE in name for name in names), f"of the folder {sorted(names)} are imported"
        return sorted(names)

    return Format("BVH", path, damaged_text, read, (UserError,), n_divisor=4)


def _mesh(suffix: str) -> Callable[[Path], Format]:
    """A damaged mesh beside a whole one, which must be imported."""

    def make(folder: Path) -> Format:
        path = samples.mesh(folder / "in", suffix)
        damage = damaged_text if suffix in (".obj", ".urdf", ".dae", ".gltf") else damaged_bytes
        return Format(f"mesh {suffix}", path, damage, _mesh_reader(folder), (UserError,))

    return make


def _mesh_reader(folder: Path, index: Path | None = None) -> Callable[[Path], object]:
    from pipelines.commands.importing.meshes import MeshSettings

    def read(path: Path) -> object:
        settings: dict[str, Any] = {"class_name": "other", "up": "z", "unit": "m"}
        library = MeshSettings(folder / "in", folder / "out", index=index, **settings).library()
        names = {model.name for model in library.models}
        # A damaged index may well exclude the whole file.
        assert index or any(WHOLE in name for name in names), f"of the folder {sorted(names)} are imported"
        return sorted(names)

    return read


def _index(folder: Path) -> Format:
    samples.mesh(folder / "in", ".obj")
    path = folder / "index.csv"
    path.write_text(samples.INDEX)
    return Format("mesh index.csv", path, damaged_text, _mesh_reader(folder, path), (UserError,))


MAKERS: dict[str, Callable[[Path], Format]] = {
    "depth-png": _depth("png"),
    "depth-pgm": _depth("pgm"),
    "depth-tiff": _depth("tiff"),
    "depth-exr": _depth("exr"),
    "depth-npy": _depth("npy"),
    "depth-raw": _depth("raw"),
    "depth-pcd-ascii": _depth("ascii.pcd"),
    "depth-pcd-binary": _depth("binary.pcd"),
    "depth-pcd-packed": _depth("packed.pcd"),
    "depth-itop": _depth("h5"),
    "depth-joints": _joints,
    "depth-folder": _frames,
    "bvh": _bvh,
    **{f"mesh{suffix}": _mesh(suffix) for suffix in (".obj", ".glb", ".gltf", ".ply", ".stl", ".dae", ".urdf")},
    "mesh-index": _index,
}
"""Files of other programs, by name; each makes its sample in a folder."""
