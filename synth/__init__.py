"""Makes labelled depth frames of people among furniture from a seed.

The names here are all that most programs need; each is loaded when it is first used.

- Frames: `FrameSource` draws them from a `SceneConfig`; a `Frame` holds depth, labels and joints. `PoseMix` and
  `ObjectMix` add captured poses and imported objects; a `Composer` puts objects before recorded people.
- Whole scenes: `RoomSource` draws rooms with several people where the settings have a `RoomConfig` and a
  `PeopleConfig`; a `RoomFrame` holds a `PersonView` of each.
- Cameras and sensors: `Camera`, `camera_named`, `free_camera`; `apply_sensor` makes clean depth a measured one.
- Bodies: `sample_body` draws a `BodySpec`, `make_body` builds it, `draw_base` and `draw_arms` pose it.
- Objects: the package `synth.occluders` draws and builds furniture; `solid_distances` measures how near it is.
- Names and codes: `JOINT_NAMES`, `BONES`, `PART_NAMES`, `OCCLUDER_CLASSES`, `JointState`.
"""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from synth.bodies.body import Body, Pose
    from synth.bodies.poses.draw import draw_arms, draw_base
    from synth.bodies.poses.hands import HandTarget, HandTargets
    from synth.bodies.rig.kinematics import joint_positions
    from synth.bodies.rig.skinning import posed_mesh
    from synth.bodies.rig.urdf import write_urdf
    from synth.bodies.shape.make import make_body
    from synth.bodies.spec import BodySpec, sample_body
    from synth.camera import Camera
    from synth.frame import Frame, FrameInfo, PersonView, RoomFrame, RoomInfo
    from synth.geometry import LabelledMesh, translation
    from synth.occluders.model import Occluder
    from synth.occluders.solids.distance import solid_distances
    from synth.render.presets import camera_named, free_camera
    from synth.render.sensors.models import SENSOR_NAMES, apply_sensor
    from synth.scene.bases import PoseMix
    from synth.scene.composed.compose import Composer
    from synth.scene.composed.config import ComposeConfig, ComposeWeights
    from synth.scene.config import SceneConfig, SceneWeights
    from synth.scene.objects import ObjectMix
    from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
    from synth.scene.room.source import RoomSource
    from synth.scene.source import FrameSource
    from synth.vocabulary import BONES, JOINT_NAMES, OCCLUDER_CLASSES, PART_NAMES, JointState

__all__ = [
    "BONES",
    "JOINT_NAMES",
    "OCCLUDER_CLASSES",
    "PART_NAMES",
    "SENSOR_NAMES",
    "Body",
    "BodySpec",
    "Camera",
    "ComposeConfig",
    "ComposeWeights",
    "Composer",
    "Frame",
    "FrameInfo",
    "FrameSource",
    "HandTarget",
    "HandTargets",
    "JointState",
    "LabelledMesh",
    "ObjectMix",
    "Occluder",
    "PeopleConfig",
    "PersonView",
    "Pose",
    "PoseMix",
    "RoomConfig",
    "RoomFrame",
    "RoomInfo",
    "RoomSource",
    "RoomWeights",
    "SceneConfig",
    "SceneWeights",
    "apply_sensor",
    "camera_named",
    "draw_arms",
    "draw_base",
    "free_camera",
    "joint_positions",
    "make_body",
    "posed_mesh",
    "sample_body",
    "solid_distances",
    "translation",
    "write_urdf",
]

__getattr__, __dir__ = exports(
    __name__,
    {
        "synth.bodies.body": (
            "Body",
            "Pose",
        ),
        "synth.bodies.poses.draw": (
            "draw_arms",
            "draw_base",
        ),
        "synth.bodies.poses.hands": (
            "HandTarget",
            "HandTargets",
        ),
        "synth.bodies.rig.kinematics": ("joint_positions",),
        "synth.bodies.rig.skinning": ("posed_mesh",),
        "synth.bodies.rig.urdf": ("write_urdf",),
        "synth.bodies.shape.make": ("make_body",),
        "synth.bodies.spec": (
            "BodySpec",
            "sample_body",
        ),
        "synth.camera": ("Camera",),
        "synth.frame": (
            "Frame",
            "FrameInfo",
            "PersonView",
            "RoomFrame",
            "RoomInfo",
        ),
        "synth.geometry": (
            "LabelledMesh",
            "translation",
        ),
        "synth.occluders.model": ("Occluder",),
        "synth.occluders.solids.distance": ("solid_distances",),
        "synth.render.presets": (
            "camera_named",
            "free_camera",
        ),
        "synth.render.sensors.models": (
            "SENSOR_NAMES",
            "apply_sensor",
        ),
        "synth.scene.bases": ("PoseMix",),
        "synth.scene.composed.compose": ("Composer",),
        "synth.scene.composed.config": (
            "ComposeConfig",
            "ComposeWeights",
        ),
        "synth.scene.config": (
            "SceneConfig",
            "SceneWeights",
        ),
        "synth.scene.objects": ("ObjectMix",),
        "synth.scene.room.config": (
            "PeopleConfig",
            "RoomConfig",
            "RoomWeights",
        ),
        "synth.scene.room.source": ("RoomSource",),
        "synth.scene.source": ("FrameSource",),
        "synth.vocabulary": (
            "BONES",
            "JOINT_NAMES",
            "OCCLUDER_CLASSES",
            "PART_NAMES",
            "JointState",
        ),
    },
)
