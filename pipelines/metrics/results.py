"""What methods answered on a corpus' frames beside the truth: one row a frame, joint and method, kept as .npz."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.foreign import reading
from pipelines.metrics.arrayfile import read_arrays
from storage.atomic import replacing
from synth.vocabulary import JointState

SCHEMA = "undergrowth results"
SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Truths:
    """What is true in the frames that methods are scored on.

    Attributes:
        joints: Names of the joints.
        occluders: Names of the occluder classes by code, 0 = none.
        families: Names of the scene families by code.
        frame: (n,) int64, frame numbers in the corpus.
        intrinsics: (n, 4) float64: fx, fy, cx, cy [px].
        upper_body_px: (n,) float32, size of the upper body in the image [px]; NaN if it has none.
        visible_fraction: (n,) float32, share of the person's pixels that no object hides.
        family: (n,) uint8 code.
        object_classes: (n,) uint16, bit c is set if the frame shows an object of class c.
        xyz: (n, n_joints, 3) float32, camera frame [m]; NaN = the joint does not exist.
        state: (n, n_joints) uint8 `JointState`.
        hiding_class: (n, n_joints) uint8, class of the object that hides the joint, 0 = none does.
    """

    joints: tuple[str, ...]
    occluders: tuple[str, ...]
    families: tuple[str, ...]
    frame: NDArray[np.int64]
    intrinsics: NDArray[np.float64]
    upper_body_px: NDArray[np.float32]
    visible_fraction: NDArray[np.float32]
    family: NDArray[np.uint8]
    object_classes: NDArray[np.uint16]
    xyz: NDArray[np.float32]
    state: NDArray[np.uint8]
    hiding_class: NDArray[np.uint8]

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.frame)

    def of_joints(self, names: Sequence[str]) -> "Truths":
        """The same of some joints, in the order given.

        Raises:
            UserError: A joint that is not there.
        """
        unknown = [name for name in names if name not in self.joints]
        if unknown:
            raise UserError(f"joints {', '.join(unknown)} are unknown; known are {', '.join(self.joints)}")
        at = [self.joints.index(name) for name in names]
        of_joint = {name: getattr(self, name)[:, at] for name in ("xyz", "state", "hiding_class")}
        return replace(self, joints=tuple(names), **of_joint)


@dataclass(frozen=True)
class Results:
    """What one method answered.

    Attributes:
        method: Its name.
        truths: The frames and what is true there.
        proposals: (n, n_joints, n_proposals, 3) float32, camera frame [m], most confident first; NaN if missing.
        proposal_confidence: (n, n_joints, n_proposals) float32, 0 where missing.
        probability: (n, n_joints) float32, that the first proposal is within 10 cm; NaN = not told.
        hidden_probability: (n, n_joints) float32, that an object hides the joint; NaN = not told.
        seconds: (n,) float32, time of the prediction.
    """

    method: str
    truths: Truths
    proposals: NDArray[np.float32]
    proposal_confidence: NDArray[np.float32]
    probability: NDArray[np.float32]
    hidden_probability: NDArray[np.float32]
    seconds: NDArray[np.float32]

    def __post_init__(self) -> None:
        shape = self.truths.xyz.shape[:2]
        for name in ("proposals", "proposal_confidence", "probability", "hidden_probability"):
            given = getattr(self, name).shape
            if given[:2] != shape:
                raise ValueError(f"{name} has shape {given}, must begin with {shape} as the truth does")
        if self.proposals.shape != (*self.proposal_confidence.shape, 3):
            given = f"{self.proposals.shape} and {self.proposal_confidence.shape}"
            raise ValueError(f"proposals and proposal_confidence have shapes {given}, must be (..., 3) and (...)")

    def of_joints(self, names: Sequence[str]) -> "Results":
        """The same of some joints, in the order given.

        Raises:
            UserError: A joint that is not there.
        """
        truths = self.truths.of_joints(names)
        at = [self.truths.joints.index(name) for name in names]
        return replace(self, truths=truths, **{name: getattr(self, name)[:, at] for name in _ANSWERS})


_NAMES = ("joints", "occluders", "families")
_OF_FRAME = ("frame", "intrinsics", "upper_body_px", "visible_fraction", "family", "object_classes")
_OF_JOINT = ("xyz", "state", "hiding_class")
_ANSWERS = ("proposals", "proposal_confidence", "probability", "hidden_probability")
_COLUMNS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "method": ("uint8", ()),
    "joint": ("uint8", ()),
    "frame": ("int64", ()),
    "intrinsics": ("float64", (4,)),
    "upper_body_px": ("float32", ()),
    "visible_fraction": ("float32", ()),
    "family": ("uint8", ()),
    "object_classes": ("uint16", ()),
    "seconds": ("float32", ()),
    "xyz": ("float32", (3,)),
    "state": ("uint8", ()),
    "hiding_class": ("uint8", ()),
    "proposals": ("float32", (None, 3)),
    "proposal_confidence": ("float32", (None,)),
    "probability": ("float32", ()),
    "hidden_probability": ("float32", ()),
}
"""Type and shape of a row's entry of each column; None is the number of proposals."""


def write_results(path: Path, results: Sequence[Results], context: Mapping[str, object]) -> None:
    """Writes rows as columns of an .npz file: beside it first, then renamed.

    Args:
        path: The file.
        results: One or more methods; they share the label tables.
        context: What a reader must know: digests, configuration; JSON values.

    Raises:
        ValueError: No methods, a name twice, or methods of different label tables.
    """
    names = [item.method for item in results]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"methods {names} must be one or more of different names")
    tables = {name: getattr(results[0].truths, name) for name in _NAMES}
    if any(getattr(item.truths, name) != tables[name] for item in results for name in _NAMES):
        raise ValueError(f"methods {names} have different joints, occluders or families")
    header = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "methods": names, **tables, "context": context}
    n_proposals = max(item.proposals.shape[2] for item in results)
    parts = [_columns(code, item, n_proposals) for code, item in enumerate(results)]
    columns: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    with replacing(path) as file:
        np.savez_compressed(file, header=np.array(json.dumps(header)), **columns)


def _columns(code: int, results: Results, n_proposals: int) -> dict[str, np.ndarray]:
    truths = results.truths
    shape = n_frames, n_joints = truths.state.shape
    columns = {
        "method": np.full(n_frames * n_joints, code, np.uint8),
        "joint": np.tile(np.arange(n_joints, dtype=np.uint8), n_frames),
    }
    per_frame = {name: getattr(truths, name) for name in _OF_FRAME} | {"seconds": results.seconds}
    columns |= {name: np.repeat(values, n_joints, axis=0) for name, values in per_frame.items()}
    per_joint = {name: getattr(truths, name) for name in _OF_JOINT}
    per_joint |= {name: getattr(results, name) for name in _ANSWERS}
    n_missing = n_proposals - results.proposals.shape[2]
    pad = ((0, 0), (0, 0), (0, n_missing))
    per_joint["proposals"] = np.pad(results.proposals, (*pad, (0, 0)), constant_values=np.nan)
    per_joint["proposal_confidence"] = np.pad(results.proposal_confidence, pad)
    return columns | {name: v.reshape(shape[0] * shape[1], *v.shape[2:]) for name, v in per_joint.items()}


def read_results(path: Path) -> tuple[list[Results], dict]:
    """Reads what `write_results` wrote.

    Returns:
        The methods in their order, and the context.

    Raises:
        UserError: No such file, no results, damaged, or another schema version.
    """
    with reading(path, "a file of results"):
        columns = read_arrays(path)
        header = json.loads(str(columns.pop("header", "")))
        found = (header.get("schema"), header.get("schema_version")) if isinstance(header, dict) else (None, None)
        if found != (SCHEMA, SCHEMA_VERSION):
            raise UserError(
                f"{path} holds {found[0]!r:.40} version {found[1]!r:.20}; "
                f"this program reads {SCHEMA} version {SCHEMA_VERSION}"
            )
        _check(path, header, columns)
        methods = enumerate(header["methods"])
        read = [_results(name, header, columns, columns["method"] == code) for code, name in methods]
    return read, header["context"]


def _check(path: Path, header: dict, columns: dict[str, np.ndarray]) -> None:
    """Refuses columns that are missing, of other types or lengths, or hold codes without a name."""
    missing = [name for name in _COLUMNS if name not in columns]
    if missing:
        raise UserError(f"{path} is damaged: it lacks the columns {', '.join(missing)}")
    for name in ("methods", *_NAMES):
        given = header[name]
        if not isinstance(given, list) or not given or not all(isinstance(word, str) for word in given):
            raise ValueError(f"{name} must be a list of names")
    if not isinstance(header["context"], dict):
        raise ValueError("context must hold values by name")
    n_rows, n_proposals = len(columns["method"]), columns["proposals"].shape[1]
    for name, (dtype, shape) in _COLUMNS.items():
        wanted = (n_rows, *(n_proposals if size is None else size for size in shape))
        values = columns[name]
        if values.dtype != dtype or values.shape != wanted:
            raise ValueError(f"column {name} is {values.dtype} {values.shape}, must be {dtype} {wanted}")
    limits = {"method": "methods", "joint": "joints", "family": "families", "hiding_class": "occluders"}
    for name, table in limits.items():
        if n_rows and columns[name].max() >= len(header[table]):
            raise ValueError(f"column {name} holds codes that have no name")
    if n_rows and columns["state"].max() > max(JointState):
        raise ValueError("column state holds codes that have no name")
    counts = np.bincount(columns["method"], minlength=len(header["methods"]))
    if (counts % len(header["joints"])).any():
        raise ValueError("a frame has the wrong number of joints")


def is_results(path: Path) -> None:
    """Makes sure that a file holds results, damaged or not.

    Raises:
        UserError: It does not.
    """
    with reading(path, "a file of results"):
        header = json.loads(str(read_arrays(path, ("header",))["header"]))
        if header["schema"] != SCHEMA:
            raise ValueError(f"it holds {header['schema']!r:.40}")


def _results(method: str, header: dict, columns: dict[str, np.ndarray], is_own: NDArray[np.bool_]) -> Results:
    n_joints = len(header["joints"])
    own: dict[str, Any] = {name: v[is_own].reshape(-1, n_joints, *v.shape[1:]) for name, v in columns.items()}
    tables: dict[str, Any] = {name: tuple(header[name]) for name in _NAMES}
    of_frame = {name: own[name][:, 0] for name in _OF_FRAME}
    truths = Truths(**tables, **of_frame, **{name: own[name] for name in _OF_JOINT})
    return Results(method, truths, **{name: own[name] for name in _ANSWERS}, seconds=own["seconds"][:, 0])


def same_frames(first: Truths, second: Truths) -> bool:
    """Whether two methods were scored on the same frames and joints."""
    pairs = [(values, getattr(second, name)) for name, values in vars(first).items()]
    return all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f") if isinstance(a, np.ndarray) else a == b
        for a, b in pairs
    )
