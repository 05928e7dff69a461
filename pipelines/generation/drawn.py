"""Frames drawn from a seed and settings, as an order for a corpus."""

import functools
from dataclasses import replace

from pipelines.corpus import ROOM_SCHEMA_VERSION, SCHEMA_VERSION, Order
from pipelines.errors import UserError
from pipelines.generation.libraries import LibraryUse, motion_mix, object_mix, pose_mix
from storage.digested import is_of_format
from synth.bodies.motion.library import FORMAT as MOTIONS
from synth.bodies.poses.library import FORMAT as POSES
from synth.bodies.skeleton import DOFS
from synth.scene import ClipSource, FrameSource, MotionMix, PoseMix, RoomSource, SceneConfig

Source = FrameSource | RoomSource | ClipSource


def drawn_order(
    scene: SceneConfig,
    seed: int,
    n_frames: int,
    renderer: str = "numba",
    poses: LibraryUse | None = None,
    objects: LibraryUse | None = None,
) -> Order[Source]:
    """A corpus of drawn people among drawn or imported objects; of whole scenes where the settings have rooms.

    Args:
        scene: What the scenes are drawn from.
        seed: Of everything random.
        n_frames: How many frames.
        renderer: numba or pyrender.
        poses: Recorded poses that some people take, if any are used.
        objects: Imported objects that some scenes take, if any are used.

    Raises:
        UserError: A library cannot be used.
    """
    _check_scenes(scene, n_frames)
    config: dict[str, object] = {"renderer": renderer, "scene": scene.told()}
    if poses is not None:
        poses = replace(poses, digest=_pose_source(scene, poses).library.digest)
        config["poses"] = poses.told()
    if objects is not None:
        objects = replace(objects, digest=object_mix(objects).library.digest)
        config["objects"] = objects.told()
    make = functools.partial(make_source, scene, seed, n_frames, renderer, poses, objects)
    angles = tuple((dof.name, dof.lower, dof.upper) for dof in DOFS)
    schema_version = ROOM_SCHEMA_VERSION if scene.room.is_on else SCHEMA_VERSION
    return Order(seed, n_frames, config, make, angles, schema_version)


def whole_frames(scene: SceneConfig, n_frames: int) -> int:
    """The number of frames, rounded up so that no scene or clip is cut."""
    return -(-n_frames // scene.frames_a_scene) * scene.frames_a_scene


def _check_scenes(scene: SceneConfig, n_frames: int) -> None:
    each = scene.frames_a_scene
    if n_frames % each:
        raise UserError(
            f"frames={n_frames} must be a multiple of {each}: a scene has {scene.cameras} cameras x "
            f"{max(scene.clip, 1)} time steps; {whole_frames(scene, n_frames)} would do"
        )


def _pose_source(scene: SceneConfig, use: LibraryUse) -> PoseMix | MotionMix:
    """Recorded motions for clips, recorded poses for single moments.

    Raises:
        UserError: The file is not a library of these, has changed, or has too little for a split.
    """
    if not scene.clip:
        if is_of_format(use.path, MOTIONS):
            raise UserError(
                f"{use.path} is a library of whole motions, for clips; for single moments leave --clips of "
                "`undergrowth import mocap` out, or set scene.clip"
            )
        return pose_mix(use)
    if is_of_format(use.path, POSES):
        raise UserError(
            f"{use.path} is a library of single poses, which have no motion; make one of motions with `undergrowth "
            "import mocap --clips`, or leave --poses out: clips draw their own"
        )
    mix = motion_mix(use)
    try:
        mix.check_length(scene.clip / scene.fps)
    except ValueError as error:
        raise UserError(f"{use.path}: {error}") from None
    return mix


def make_source(
    scene: SceneConfig,
    seed: int,
    n_frames: int,
    renderer: str,
    poses: LibraryUse | None = None,
    objects: LibraryUse | None = None,
) -> Source:
    """The frames of such a corpus; arguments as of `drawn_order`.

    Raises:
        UserError: The renderer's library or device is missing or draws no rooms, or a library cannot be used.
    """
    if scene.room.is_on and renderer != "numba":
        raise UserError(f"the renderer {renderer} draws single people; rooms are drawn by numba alone")
    pose_source = None if poses is None else _pose_source(scene, poses)
    object_source = None if objects is None else object_mix(objects)
    try:
        if isinstance(pose_source, MotionMix) or scene.clip:
            return ClipSource(scene, seed, n_frames, renderer, pose_source, object_source)
        make = RoomSource if scene.room.is_on else FrameSource
        return make(scene, seed, n_frames, renderer, pose_source, object_source)
    except (ImportError, RuntimeError) as error:
        raise UserError(f"the renderer {renderer} cannot start: {error}") from error
