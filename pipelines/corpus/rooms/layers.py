"""Whole scenes as stored entries and back; of each body layer is stored what the composite does not show."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.corpus.fields import OF_PEOPLE, moment_values
from pipelines.corpus.layers import body_layer
from synth.camera import Camera
from synth.frame import Moment, PersonMotion, PersonView, RoomFrame, RoomInfo
from synth.vocabulary import CONTACT_NAMES, MAX_PEOPLE, N_JOINTS, N_PARTS, SPLITS, JointState


@njit(cache=True, nogil=True)
def _hide_seen(  # type: ignore[no-untyped-def]
    depth, part, person, number, left, top, body_depth, body_part, hidden_depth, hidden_part
):
    """Fills hidden_* (height, width), zeros before, with a body's crop where the composite does not show the same.

    Returns:
        How many pixels show the person outside the crop, and how many inside where the body has none.
    """
    n_inside, n_wrong = 0, 0
    for y in range(body_part.shape[0]):
        for x in range(body_part.shape[1]):
            seen = part[top + y, left + x] if person[top + y, left + x] == number else np.uint8(0)
            own = body_part[y, x]
            is_same = (seen != 0) & (own == seen) & (body_depth[y, x] == depth[top + y, left + x])
            hidden_depth[top + y, left + x] = np.uint16(0) if is_same else body_depth[y, x]
            hidden_part[top + y, left + x] = np.uint8(0) if is_same else own
            n_inside += seen != 0
            n_wrong += (seen != 0) & (own == 0)
    n_all = 0
    for y in range(person.shape[0]):
        for x in range(person.shape[1]):
            n_all += person[y, x] == number
    return n_all - n_inside, n_wrong


def hidden_layers(frame: RoomFrame) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
    """What the composite hides of each person: zeros where it shows them.

    Returns:
        (n_people, height, width) uint16 depth [mm] and (n_people, height, width) uint8 part.

    Raises:
        ValueError: The composite shows a person where their body layer has none.
    """
    shape = (len(frame.people), *frame.depth.shape)
    hidden_depth, hidden_part = np.zeros(shape, np.uint16), np.zeros(shape, np.uint8)
    for k, view in enumerate(frame.people):
        left, top, _, _ = view.box
        n_outside, n_wrong = _hide_seen(
            frame.depth, frame.part, frame.person, k + 1, left, top,
            view.body_depth, view.body_part, hidden_depth[k], hidden_part[k],
        )  # fmt: skip
        if n_outside:
            raise ValueError(f"the composite shows person {k + 1} in {n_outside} pixels outside their box")
        if n_wrong:
            raise ValueError(f"the composite shows a person in {n_wrong} pixels where the body layer has none")
    return hidden_depth, hidden_part


def room_values(frame: RoomFrame, n_dof: int) -> dict[str, np.ndarray]:
    """A scene's entries by array name; the hidden layers of absent people, which hold nothing, are left out.

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
    return values | moment_values(frame.moment) | _motion_values(frame)


def _motion_values(frame: RoomFrame) -> dict[str, np.ndarray]:
    """How the people of a clip move, by array name; nothing of single moments."""
    motions = [view.motion for view in frame.people]
    if frame.moment is None or (motions and None in motions):
        return {}
    values: dict[str, np.ndarray] = {
        "joints_world": np.full((MAX_PEOPLE, N_JOINTS, 3), np.nan, np.float32),
        "joint_velocity": np.zeros((MAX_PEOPLE, N_JOINTS, 3), np.float32),
        "contacts": np.zeros((MAX_PEOPLE, len(CONTACT_NAMES)), np.uint8),
    }
    for k, motion in enumerate(motions):
        assert motion is not None
        values["joints_world"][k] = motion.joints_world
        values["joint_velocity"][k] = motion.velocity
        values["contacts"][k] = motion.contacts
    return values


def _motion(values: dict[str, np.ndarray], k: int) -> PersonMotion | None:
    if "contacts" not in values:
        return None
    return PersonMotion(values["joints_world"][k], values["joint_velocity"][k], values["contacts"][k])


def moment_of(values: dict[str, np.ndarray]) -> Moment | None:
    """Clip, time and view of a frame's stored entries; None where it stands alone."""
    if "clip" not in values:
        return None
    return Moment(int(values["clip"]), int(values["time"]), int(values["view"]))


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
                motion=_motion(values, k),
            )
        )
    maps = {name: values[name] for name in ("depth", "part", "person", "occluder", "instance")}
    return RoomFrame(
        **maps,
        people=tuple(people),
        T_world_camera=values["T_world_camera"],
        camera=camera,
        info=info,
        moment=moment_of(values),
    )
