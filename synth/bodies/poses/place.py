"""Poses out of a library, placed on a body of any size: feet on the floor or hips on a seat."""

from dataclasses import replace

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.lap import lay_hands_in_lap
from synth.bodies.poses.library import PoseLibrary
from synth.bodies.poses.recorded import MAX_GAP, free_arms, sit_on_seat, stand_on_feet
from synth.bodies.poses.stand import curl_fingers, hang_arm
from synth.bodies.rig.collision import self_collides
from synth.bodies.rig.skinning import pose_vertices


def place_pose(
    library: PoseLibrary,
    row: int,
    body: Body,
    rng: np.random.Generator,
    seat_height: float | None = None,
    keeps_arms: bool = True,
) -> Pose | None:
    """Puts a library's pose on a body.

    Trunk, head and arms are the library's; legs are bent as little as it takes to put the feet on the floor,
    or the thighs along the seat.

    Args:
        library: The poses.
        row: Which one.
        body: The person.
        rng: Draws how the fingers are bent, and the arms if they are not kept.
        seat_height: Top of the seat above the floor [m], for a pose that sits.
        keeps_arms: False hangs the arms or lays them in the lap, for a table or a handle that will move them.

    Returns:
        The pose in the person frame with `source_id` set, or None if it does not fit this body.
    """
    if bool(library.is_sitting[row]) != (seat_height is not None):
        raise ValueError(f"pose {library.pose_id(row)}: a seat height is for poses that sit, and needed by them")
    draft = Draft(body, library.angles[row].astype(np.float64))
    draft.T_world_root[:3, :3] = library.root[row]
    for side in "lr":
        curl_fingers(draft, side, rng, 18, 22)
    is_placed = stand_on_feet(draft, library.feet[row]) if seat_height is None else sit_on_seat(draft, seat_height)
    if not is_placed:
        return None
    if not keeps_arms and seat_height is not None:
        lay_hands_in_lap(draft, rng)
    elif not keeps_arms:
        for side in "lr":
            draft.set(f"{side}_", shoulder_flexion=0.0)
            hang_arm(draft, side, rng, 1.0)
    else:
        free_arms(draft)
    pose = replace(
        draft.pose("mocap_sitting" if seat_height else "mocap_standing"), source_id=library.pose_id(row)
    )
    return pose if _is_sound(body, pose, keeps_arms) else None


def _is_sound(body: Body, pose: Pose, keeps_arms: bool) -> bool:
    if float(pose_vertices(body, pose)[:, 2].min()) < -MAX_GAP:
        return False
    if keeps_arms:
        return not self_collides(body, pose)
    return max(Draft.of(body, pose).excess_of(side, "leg") for side in "lr") <= 0.0
