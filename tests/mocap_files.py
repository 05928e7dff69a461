"""BVH files made from poses of our own skeleton, so that the truth of a recording is known."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synth.bodies.mocap.bvh import END, Bvh, parse_bvh, place_joints
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, N_DOFS, UPPER, Lengths, make_skeleton

SKELETON = make_skeleton(Lengths.of_stature(1.7))
AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Rows: our forward, left and up in the axes of the file, which has y up and faces z."""
_SIDED = (
    ("Shoulder", "thorax", "clavicle_protraction"), ("Arm", "Shoulder", "shoulder_rotation"),
    ("ForeArm", "Arm", "elbow_flexion"), ("Hand", "ForeArm", "wrist_deviation"), ("UpLeg", "Hips", "hip_rotation"),
    ("Leg", "UpLeg", "knee_flexion"), ("Foot", "Leg", "ankle_inversion"), ("ToeBase", "Foot", "toes_extension"),
)  # fmt: skip
_ORIGIN = {
    "lumbar_rotation": "lumbar_flexion", "thorax_rotation": "thorax_flexion", "neck_rotation": "neck_flexion",
    "head_rotation": "head_flexion",
}  # fmt: skip


def joint_table() -> list[tuple[str, str, str]]:
    """Name, parent and link of each joint, in the naming of MotionBuilder."""
    table = [
        ("Hips", "", "root"),
        ("Spine", "Hips", "lumbar_rotation"),
        ("Spine1", "Spine", "thorax_rotation"),
        ("Neck1", "Spine1", "neck_rotation"),
        ("Head", "Neck1", "head_rotation"),
    ]
    for side, word in (("l", "Left"), ("r", "Right")):
        for name, parent, link in _SIDED:
            above = {"thorax": "Spine1", "Hips": "Hips"}.get(parent, word + parent)
            table.append((word + name, above, f"{side}_{link}"))
    return table


def degrees(**values: float) -> NDArray[np.float64]:
    """(n_dofs,) angles [rad] by hinge; names without a side set both."""
    out = np.zeros(N_DOFS)
    for name, value in values.items():
        for full in [name] if name in DOF_IDX else [f"l_{name}", f"r_{name}"]:
            out[DOF_IDX[full]] = np.radians(value)
    return out


T_POSE = degrees(shoulder_abduction=90.0)
STAND = degrees(shoulder_abduction=8.0, elbow_flexion=15.0)
SIT = degrees(
    hip_flexion=88.0, knee_flexion=85.0, shoulder_flexion=25.0, elbow_flexion=60.0, shoulder_abduction=12.0
)


def random_angles(rng: np.random.Generator) -> NDArray[np.float64]:
    """(n_dofs,) a lively pose within the limits."""
    return np.clip(0.45 * rng.uniform(-1.0, 1.0, N_DOFS), LOWER + 0.02, UPPER - 0.02)


def standing_root(angles: NDArray[np.float64], R: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """(4, 4) T_world_root with the lower ankle as high as the foot is thick."""
    T = np.eye(4)
    T[:3, :3] = np.eye(3) if R is None else R
    ankles = link_transforms(SKELETON, angles, T)[[LINK_IDX[f"{s}_ankle_inversion"] for s in "lr"], 2, 3]
    T[2, 3] = 0.07 - float(ankles.min())
    return T


def resting_root(
    angles: NDArray[np.float64], R: NDArray[np.float64] | None = None, clearance: float = 0.07
) -> NDArray[np.float64]:
    """(4, 4) T_world_root with the lowest of hips, neck, elbows, knees and ankles so high above the floor [m]."""
    names = ["root", "neck_flexion"]
    names += [f"{s}_{name}" for s in "lr" for name in ("elbow_flexion", "knee_flexion", "ankle_inversion")]
    T = np.eye(4)
    T[:3, :3] = np.eye(3) if R is None else R
    T[2, 3] = clearance - float(link_transforms(SKELETON, angles, T)[[LINK_IDX[n] for n in names], 2, 3].min())
    return T


def bvh_text(
    poses: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
    unit: float = 0.01,
    scale: float = 1.0,
    rest: NDArray[np.float64] = T_POSE,
) -> str:
    """A BVH file that starts with its rest pose.

    Args:
        poses: Angles and T_world_root of each frame after the first.
        unit: Size of the file's unit [m].
        scale: Size of the recorded person over ours.
        rest: Angles in the rest pose.
    """
    table = joint_table()
    T_rest = link_transforms(SKELETON, rest, standing_root(rest))
    place = {name: _origin(T_rest, link) for name, _, link in table}
    frames = [_frame(table, T_rest, rest, standing_root(rest), unit, scale)]
    frames += [_frame(table, T_rest, angles, root, unit, scale) for angles, root in poses]
    lines = ["HIERARCHY", *_joint_lines(table, place, "Hips", unit, scale, 0)]
    lines += ["MOTION", f"Frames: {len(frames)}", "Frame Time: 0.033333"]
    return "\n".join(lines + frames) + "\n"


def _origin(T: NDArray[np.float64], link: str) -> NDArray[np.float64]:
    return T[LINK_IDX[_ORIGIN.get(link, link)], :3, 3]


def _joint_lines(table: list, place: dict, name: str, unit: float, scale: float, depth: int) -> list[str]:
    parent = next(row[1] for row in table if row[0] == name)
    offset = AXES.T @ (place[name] - place[parent]) * scale / unit if parent else np.zeros(3)
    children = [row[0] for row in table if row[1] == name]
    moves = "6 Xposition Yposition Zposition " if not parent else "3 "
    lines = [f"{'JOINT' if parent else 'ROOT'} {name}", "{", "OFFSET " + " ".join(f"{v:.6f}" for v in offset)]
    lines += [f"CHANNELS {moves}Zrotation Xrotation Yrotation"]
    for child in children:
        lines += _joint_lines(table, place, child, unit, scale, depth + 1)
    return [*lines, *([] if children else ["End Site", "{", "OFFSET 0 0 1", "}"]), "}"]


def _frame(table: list, T_rest: NDArray, angles: NDArray, root: NDArray, unit: float, scale: float) -> str:
    T = link_transforms(SKELETON, angles, root)
    turn = {
        name: AXES.T @ T[LINK_IDX[link], :3, :3] @ T_rest[LINK_IDX[link], :3, :3].T @ AXES
        for name, _, link in table
    }
    values = [*(AXES.T @ root[:3, 3] * scale / unit)]
    for name, parent, _ in _in_file_order(table):
        local = turn[parent].T @ turn[name] if parent else turn[name]
        values += [*Rotation.from_matrix(local).as_euler("ZXY", degrees=True)]
    return " ".join(f"{value:.6f}" for value in values)


def _in_file_order(table: list, name: str = "Hips") -> list:
    out = [next(row for row in table if row[0] == name)]
    for child in [row[0] for row in table if row[1] == name]:
        out += _in_file_order(table, child)
    return out


def rewritten(text: str, order: str = "ZXY", places: str = "", A: NDArray[np.float64] | None = None) -> str:
    """The same recording as another program writes it.

    Args:
        text: A BVH file.
        order: Of the turns about the axes.
        places: What position channels of joints below the root hold: "offsets", "zeros"; "" = none.
        A: (3, 3) rotation from its axes to the new file's.
    """
    bvh = parse_bvh(text)
    A = np.eye(3) if A is None else A
    position, rotation = place_joints(bvh, bvh.values)
    local = [
        rotation[:, j] if joint.parent < 0 else np.swapaxes(rotation[:, joint.parent], 1, 2) @ rotation[:, j]
        for j, joint in enumerate(bvh.joints)
    ]
    turns = [Rotation.from_matrix(A @ turn @ A.T).as_euler(order, degrees=True) for turn in local]
    joints, columns = [], []
    for j, joint in enumerate(bvh.joints):
        x, y, z = A @ np.array(joint.offset)
        is_end = joint.name.endswith(END)
        moves = "XYZ" if (joint.parent < 0 or places) and not is_end else ""
        channels = (*(f"{axis}position" for axis in moves), *(f"{axis}rotation" for axis in order if not is_end))
        joints.append(replace(joint, offset=(x, y, z), channels=channels))
        if joint.parent < 0:
            columns.append(position[:, j] @ A.T)
        elif moves:
            columns.append(np.tile(np.array([x, y, z]) * (places == "offsets"), (len(position), 1)))
        if not is_end:
            columns.append(turns[j])
    return text_of(replace(bvh, joints=tuple(joints), values=np.concatenate(columns, axis=1)))


def with_axes_anywhere(bvh: Bvh, rng: np.random.Generator) -> Bvh:
    """The same motion by joints whose own axes point anywhere, so that the pose without turns is a tangle."""
    position, rotation = place_joints(bvh, bvh.values)
    own = Rotation.random(len(bvh.joints), rng).as_matrix()
    turned = rotation @ own
    joints, values = [], []
    for j, joint in enumerate(bvh.joints):
        above = own[joint.parent] if joint.parent >= 0 else np.eye(3)
        x, y, z = above.T @ joint.offset
        joints.append(replace(joint, offset=(x, y, z)))
        local = np.swapaxes(turned[:, joint.parent], 1, 2) @ turned[:, j] if joint.parent >= 0 else turned[:, j]
        order = "".join(name[0] for name in joint.channels if name.endswith("rotation"))
        if any(name.endswith("position") for name in joint.channels):
            values.append(position[:, j] if joint.parent < 0 else np.zeros((len(position), 3)))
        if order:
            values.append(Rotation.from_matrix(local).as_euler(order, degrees=True))
    return replace(bvh, joints=tuple(joints), values=np.concatenate(values, axis=1))


def text_of(bvh: Bvh) -> str:
    """A BVH file of a recording."""
    lines, depth = ["HIERARCHY"], []
    for j, joint in enumerate(bvh.joints):
        while depth and depth[-1] != joint.parent:
            depth.pop()
            lines.append("}")
        word = "End Site" if joint.name.endswith(END) else f"{'JOINT' if depth else 'ROOT'} {joint.name}"
        lines += [word, "{", "OFFSET " + " ".join(f"{value:.6f}" for value in joint.offset)]
        if joint.channels:
            lines.append(f"CHANNELS {len(joint.channels)} {' '.join(joint.channels)}")
        depth.append(j)
    lines += ["}"] * len(depth) + ["MOTION", f"Frames: {len(bvh.values)}", f"Frame Time: {bvh.frame_time}"]
    return "\n".join([*lines, *(" ".join(f"{value:.6f}" for value in row) for row in bvh.values)]) + "\n"
