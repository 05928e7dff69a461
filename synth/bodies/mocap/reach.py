"""How far retargeted limbs are off the recording: what our joint limits do not let a body follow."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.rest import SIDES, angles_between
from synth.bodies.mocap.retarget import Retargeted
from synth.bodies.mocap.source import Source
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import LINK_IDX, Lengths, make_skeleton

LIMB_LINKS = ("shoulder_rotation", "elbow_flexion", "hip_rotation", "knee_flexion")
"""Links of upper arm, forearm, thigh and shank, without the side."""


def limb_errors(source: Source, poses: Retargeted) -> NDArray[np.float64]:
    """Angles between the limbs of a recording and those of the retargeted body.

    Args:
        source: The motion.
        poses: From `retarget`.

    Returns:
        (n, 2, 4) by side: upper arm, forearm, thigh, shank [rad].
    """
    skeleton = make_skeleton(Lengths.of_stature(1.7))
    links = np.array([[LINK_IDX[f"{s}_{link}"] for link in LIMB_LINKS] for s in SIDES])
    ours = np.empty((len(poses.angles), 2, 4, 3))
    for k, angles in enumerate(poses.angles):
        ours[k] = -link_transforms(skeleton, angles, np.eye(4))[links, :3, 2]
    theirs = np.einsum("nba,nskb->nska", source.pelvis, source.limb)
    return angles_between(ours, theirs)
