"""A motion library out of BVH motion capture: whole stretches of recordings, for clips."""

import logging
from pathlib import Path

from pipelines.errors import UserError
from pipelines.importing.mocap import AVERAGE, MAX_MISS, MocapOptions, read_files, read_motion
from synth.bodies.mocap.capture import RecordedMotion, stretches_of
from synth.bodies.mocap.ground import find_support
from synth.bodies.mocap.reach import limb_errors
from synth.bodies.mocap.retarget import retarget
from synth.bodies.motion.captured import captured
from synth.bodies.motion.library import MotionLibrary, joined_motions
from synth.bodies.poses.library import Trial
from synth.bodies.shape.make import make_body

log = logging.getLogger(__name__)

RATE = 60.0
"""Motions are tried on an average body at so many samples a second."""


def import_motions(folder: Path, options: MocapOptions) -> MotionLibrary:
    """Reads all files and keeps the stretches in which people are on their feet and that fit an average body.

    Args:
        folder: Where the .bvh files are, at any depth.
        options: How they become a library; its distance does not matter.

    Raises:
        UserError: There is no file, none can be used, or none holds a motion.
    """
    body = make_body(AVERAGE)
    parts: list[tuple[Trial, list[RecordedMotion], list[int]]] = []

    def read(path: Path, trial: Trial) -> None:
        taken, source = read_motion(path, options)
        poses, support = retarget(source), find_support(source, taken.frame_time)
        is_near = limb_errors(source, poses).max(axis=(1, 2)) < MAX_MISS
        is_usable = ~(source.is_t_pose | support.is_on_floor | support.is_sitting) & is_near
        stretches = stretches_of(source, poses, is_usable, 1.0 / taken.frame_time, trial.name)
        fitting = [(first, motion) for first, motion in stretches if captured(motion, body, RATE) is not None]
        motions = [motion for _, motion in fitting]
        log.info(
            "%-5s %-24s %5d frames, %4d on their feet, %2d motions, %2d do not fit, %5.1f s kept",
            trial.split, trial.file, len(is_usable), int(is_usable.sum()), len(stretches),
            len(stretches) - len(fitting), sum(motion.seconds for motion in motions),
        )  # fmt: skip
        parts.append((trial, motions, [int(taken.frame[first]) for first, _ in fitting]))

    read_files(folder, options, read)
    library = joined_motions("mocap", parts, {"seed": options.splits.seed})
    if not len(library):
        raise UserError(f"no motion of the {len(parts)} usable files in {folder} is left to keep")
    return library
