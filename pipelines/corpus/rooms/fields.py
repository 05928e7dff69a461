"""The arrays of a corpus of whole scenes: maps of a frame, and for each of its people what frames of one have."""

import numpy as np

from pipelines.corpus.fields import Field, fields_of
from pipelines.corpus.rooms.layers import hidden_layers
from synth.frame import RoomFrame
from synth.vocabulary import MAX_PEOPLE, N_JOINTS, N_PARTS, SPLITS, JointState

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


def _hidden(name: str, dtype: str, image: tuple[int, int], unit: str, meaning: str) -> Field:
    return Field(name, dtype, (MAX_PEOPLE, *image), unit, meaning, MAX_PEOPLE)


def room_values(frame: RoomFrame, n_dof: int) -> dict[str, np.ndarray]:
    """A scene's entries by array name.

    Args:
        frame: The scene.
        n_dof: Joint angles of the skeleton.
    """
    n = len(frame.people)
    hidden_depth, hidden_part = hidden_layers(frame)
    camera = frame.camera
    values: dict[str, np.ndarray] = {
        "depth": frame.depth,
        "part": frame.part,
        "person": frame.person,
        "occluder": frame.occluder,
        "instance": frame.instance,
        "hidden_depth": hidden_depth,
        "hidden_part": hidden_part,
        "n_people": np.array(n, dtype=np.uint8),
        "box": np.zeros((MAX_PEOPLE, 4), np.uint16),
        "joints": np.full((MAX_PEOPLE, N_JOINTS, 3), np.nan, np.float32),
        "joint_state": np.full((MAX_PEOPLE, N_JOINTS), JointState.UNKNOWN.value, np.uint8),
        "joint_visible_fraction": np.zeros((MAX_PEOPLE, N_JOINTS), np.float32),
        "part_visible_fraction": np.zeros((MAX_PEOPLE, N_PARTS + 1), np.float32),
        "angles": np.zeros((MAX_PEOPLE, n_dof), np.float32),
        "T_world_root": np.tile(np.eye(4), (MAX_PEOPLE, 1, 1)),
        "T_world_camera": frame.T_world_camera,
        "intrinsics": np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        "split": np.array(SPLITS.index(frame.info.split), dtype=np.uint8),
    }
    for k, view in enumerate(frame.people):
        values["box"][k] = view.box
        for name in OF_PEOPLE:
            values[name][k] = getattr(view, name)
    return values
