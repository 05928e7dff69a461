"""The arrays of a corpus: what each field of a frame is called, holds and measures on disk."""

import math
from dataclasses import dataclass

import numpy as np

from synth.frame import Frame, Moment
from synth.vocabulary import CONTACT_NAMES, MAX_PEOPLE, N_JOINTS, N_PARTS, SPLITS

SHARD_FRAMES = 64
"""Frames in one shard, which one worker writes at once."""


@dataclass(frozen=True)
class Field:
    """One array of the corpus, its first axis the frame.

    Attributes:
        name: The array's name in the Zarr group.
        dtype: numpy name of its element type.
        shape: Shape of one frame's entry.
        unit: Unit, or "" for codes and shares.
        meaning: One sentence for the array's attributes.
        n_layers: A frame's entry is stored as so many maps, each a compressed chunk of its own.
    """

    name: str
    dtype: str
    shape: tuple[int, ...]
    unit: str
    meaning: str
    n_layers: int = 1

    @property
    def is_image(self) -> bool:
        """Whether a frame's entry is a map of pixels, stored as a compressed chunk of its own."""
        return self.name in IMAGES

    @property
    def numpy_dtype(self) -> np.dtype:
        """The element type, little endian."""
        return np.dtype(self.dtype).newbyteorder("<")

    @property
    def n_chunks(self) -> int:
        """Compressed chunks of a full shard."""
        return SHARD_FRAMES * self.n_layers

    @property
    def chunk_shape(self) -> tuple[int, ...]:
        """Shape of one compressed chunk, its first axis the frame."""
        return (1, *self.shape) if self.n_layers == 1 else (1, 1, *self.shape[1:])

    @property
    def n_chunk_bytes(self) -> int:
        """Bytes of one chunk before it is compressed."""
        return math.prod(self.chunk_shape) * self.numpy_dtype.itemsize


IMAGES = ("depth", "part", "person", "occluder", "instance", "hidden_depth", "hidden_part")
"""Stored maps; hidden_* is the body layer where the composite does not show it."""


def fields_of(height: int, width: int, n_dof: int) -> dict[str, Field]:
    """All stored arrays of a corpus of one image size.

    Args:
        height: Image height [px].
        width: Image width [px].
        n_dof: Joint angles of the skeleton.
    """
    image = (height, width)
    listed = (
        Field("depth", "uint16", image, "mm", "composite depth along the optical axis, 0 = nothing"),
        Field("part", "uint8", image, "", "composite body part label, 0 where no person is seen"),
        Field("occluder", "uint8", image, "", "composite occluder class code, 0 elsewhere"),
        Field("instance", "uint8", image, "", "composite object number, 0 elsewhere"),
        Field("hidden_depth", "uint16", image, "mm", "depth of the person alone where the composite hides it"),
        Field("hidden_part", "uint8", image, "", "part of the person alone where the composite hides it"),
        Field("joints", "float32", (N_JOINTS, 3), "m", "joint centres, camera frame"),
        Field("joint_state", "uint8", (N_JOINTS,), "", "joint state code"),
        Field("joint_visible_fraction", "float32", (N_JOINTS,), "", "share of the surface over the joint seen"),
        Field("part_visible_fraction", "float32", (N_PARTS + 1,), "", "composite over body-alone pixels"),
        Field("angles", "float32", (n_dof,), "rad", "joint angles of the skeleton"),
        Field("T_world_root", "float64", (4, 4), "m", "pose of the body's root, world z up"),
        Field("T_world_camera", "float64", (4, 4), "m", "pose of the camera, OpenCV axes"),
        Field("intrinsics", "float64", (4,), "px", "fx, fy, cx, cy; pixel centres at integers"),
        Field("split", "uint8", (), "", "split code: " + ", ".join(f"{i} {s}" for i, s in enumerate(SPLITS))),
    )
    return {item.name: item for item in listed}


OF_PEOPLE = (
    "joints", "joint_state", "joint_visible_fraction", "part_visible_fraction", "angles", "T_world_root",
)  # fmt: skip
"""Arrays with an entry for each person."""


def room_fields_of(height: int, width: int, n_dof: int) -> dict[str, Field]:
    """All stored arrays of a corpus of whole scenes.

    Args:
        height: Image height [px].
        width: Image width [px].
        n_dof: Joint angles of the skeleton.
    """
    image = (height, width)
    single = fields_of(height, width, n_dof)
    listed = [
        single["depth"],
        Field("part", "uint8", image, "", "composite body part label, 0 where nobody is seen"),
        Field("person", "uint8", image, "", "composite number of the person, from 1, 0 where nobody is seen"),
        Field("occluder", "uint8", image, "", "composite class code of objects and surfaces, 0 elsewhere"),
        Field("instance", "uint8", image, "", "composite number of the object or surface, 0 elsewhere"),
        _hidden("hidden_depth", "uint16", image, "mm", "depth of each person alone where the composite hides it"),
        _hidden("hidden_part", "uint8", image, "", "part of each person alone where the composite hides it"),
        Field(
            "n_people", "uint8", (), "", "people of the frame: so many entries of the arrays of people are used"
        ),
        Field("box", "uint16", (MAX_PEOPLE, 4), "px", "left, top, width, height of each person alone"),
    ]
    for name in OF_PEOPLE:
        item = single[name]
        listed.append(Field(name, item.dtype, (MAX_PEOPLE, *item.shape), item.unit, f"{item.meaning}, by person"))
    listed += [single["T_world_camera"], single["intrinsics"], single["split"]]
    return {item.name: item for item in listed}


def moment_fields() -> dict[str, Field]:
    """Arrays that say which clip, time step and camera a frame is of."""
    listed = (
        Field("clip", "uint32", (), "", "number of the clip, or of the scene, in the split"),
        Field("time", "uint32", (), "", "number of the time step in the clip"),
        Field("view", "uint32", (), "", "number of the camera"),
    )
    return {item.name: item for item in listed}


def motion_fields() -> dict[str, Field]:
    """Arrays that say how the people of a clip move."""
    joints = (MAX_PEOPLE, N_JOINTS, 3)
    listed = (
        Field("joints_world", "float32", joints, "m", "joint centres, world frame, by person"),
        Field("joint_velocity", "float32", joints, "m/s", "velocities of joint centres, world frame, by person"),
        Field(
            "contacts",
            "uint8",
            (MAX_PEOPLE, len(CONTACT_NAMES)),
            "",
            "1 where something of a person touches: " + ", ".join(CONTACT_NAMES),
        ),
    )
    return {item.name: item for item in listed}


def _hidden(name: str, dtype: str, image: tuple[int, int], unit: str, meaning: str) -> Field:
    return Field(name, dtype, (MAX_PEOPLE, *image), unit, meaning, MAX_PEOPLE)


def stored_values(frame: Frame) -> dict[str, np.ndarray]:
    """A frame's entries by array name."""
    from pipelines.corpus.layers import hidden_layer

    hidden_depth, hidden_part = hidden_layer(frame.depth, frame.part, frame.body_depth, frame.body_part)
    camera = frame.camera
    values: dict[str, np.ndarray] = {
        "depth": frame.depth,
        "part": frame.part,
        "occluder": frame.occluder,
        "instance": frame.instance,
        "hidden_depth": hidden_depth,
        "hidden_part": hidden_part,
        "joints": frame.joints,
        "joint_state": frame.joint_state,
        "joint_visible_fraction": frame.joint_visible_fraction,
        "part_visible_fraction": frame.part_visible_fraction,
        "angles": frame.angles,
        "T_world_root": frame.T_world_root,
        "T_world_camera": frame.T_world_camera,
        "intrinsics": np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        "split": np.array(SPLITS.index(frame.info.split), dtype=np.uint8),
    }
    return values | moment_values(frame.moment)


def moment_values(moment: Moment | None) -> dict[str, np.ndarray]:
    """Entries of `moment_fields`; none where a frame stands alone."""
    if moment is None:
        return {}
    return {name: np.array(getattr(moment, name), np.uint32) for name in ("clip", "time", "view")}
