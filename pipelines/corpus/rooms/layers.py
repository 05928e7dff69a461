"""Whole scenes as stored entries and back; of each body layer is stored what the composite does not show."""

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus.fields import OF_PEOPLE
from pipelines.corpus.layers import body_layer, hidden_layer
from synth.camera import Camera
from synth.frame import PersonView, RoomFrame, RoomInfo
from synth.vocabulary import MAX_PEOPLE, N_JOINTS, N_PARTS, SPLITS, JointState


def hidden_layers(frame: RoomFrame) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
    """What the composite hides of each person: zeros where it shows them.

    Returns:
        (8, height, width) uint16 depth [mm] and (8, height, width) uint8 part.

    Raises:
        ValueError: The composite shows a person where their body layer has none.
    """
    shape = (MAX_PEOPLE, *frame.depth.shape)
    hidden_depth, hidden_part = np.zeros(shape, np.uint16), np.zeros(shape, np.uint8)
    for k, view in enumerate(frame.people):
        window = view.window
        part = np.where(frame.person[window] == k + 1, frame.part[window], 0).astype(np.uint8)
        n_outside = np.count_nonzero(frame.person == k + 1) - np.count_nonzero(part)
        if n_outside:
            raise ValueError(f"the composite shows person {k + 1} in {n_outside} pixels outside their box")
        hidden_depth[k][window], hidden_part[k][window] = hidden_layer(
            frame.depth[window], part, view.body_depth, view.body_part
        )
    return hidden_depth, hidden_part


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


def room_frame(values: dict[str, np.ndarray], camera: Camera, info: RoomInfo) -> RoomFrame:
    """A scene out of its stored entries.

    Args:
        values: By array name.
        camera: Its intrinsics.
        info: Its record.
    """
    people = []
    for k in range(min(int(values["n_people"]), MAX_PEOPLE)):
        left, top, width, height = (int(v) for v in values["box"][k])
        window = slice(top, top + height), slice(left, left + width)
        part = np.where(values["person"][window] == k + 1, values["part"][window], 0).astype(np.uint8)
        flat = (values["depth"][window], part, values["hidden_depth"][k][window], values["hidden_part"][k][window])
        body_depth, body_part = body_layer(*map(np.ascontiguousarray, flat))
        people.append(
            PersonView(
                box=(left, top, width, height),
                body_depth=body_depth,
                body_part=body_part,
                joints=values["joints"][k],
                joint_state=values["joint_state"][k],
                joint_visible_fraction=values["joint_visible_fraction"][k],
                part_visible_fraction=values["part_visible_fraction"][k],
                angles=values["angles"][k],
                T_world_root=values["T_world_root"][k],
            )
        )
    maps = {name: values[name] for name in ("depth", "part", "person", "occluder", "instance")}
    return RoomFrame(
        **maps, people=tuple(people), T_world_camera=values["T_world_camera"], camera=camera, info=info
    )
