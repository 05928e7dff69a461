"""Which layout a folder has: by name, from a file, or found from what lies in it."""

from pathlib import Path

from pipelines.errors import UserError
from pipelines.recordings.entries import list_files, readable
from pipelines.recordings.itop import as_exported
from pipelines.recordings.layout import Layout, known_layouts, read_layout


def choose_layout(folder: Path, wanted: str | None) -> tuple[str, Layout]:
    """The layout named, read from a file, or found from the folder's contents, with its name.

    Exports of our own in ITOP's format tell the size and the camera of their images, which are taken over.

    Raises:
        UserError: Unknown name, a file that is no layout, or none or several recognised.
    """
    known = known_layouts()
    if wanted in known:
        return wanted, _fitted(folder, known[wanted])
    if wanted is not None and wanted.endswith(".toml"):
        return readable(Path(wanted).stem), read_layout(Path(wanted))
    listed = ", ".join(known)
    if wanted is not None:
        raise UserError(f"layout {wanted!r} is unknown; known are {listed}, or give a .toml file")
    found = recognised(folder)
    if len(found) == 1:
        return found[0], _fitted(folder, known[found[0]])
    if found:
        raise UserError(f"{folder} fits the layouts {' and '.join(found)}; choose one with --layout")
    raise UserError(f"{folder} fits no known layout ({listed}); describe it in a .toml file and give --layout")


def recognised(folder: Path) -> list[str]:
    """Names of the known layouts that a folder's contents are told to be of."""
    return [name for name, layout in known_layouts().items() if layout.matches(folder)]


def _fitted(folder: Path, layout: Layout) -> Layout:
    """The layout, or with the size and camera that the first file tells that tells any."""
    if layout.format != "itop":
        return layout
    told = (as_exported(path, layout) for path in list_files(folder, layout.files))
    return next((fitted for fitted in told if fitted is not layout), layout)
