"""What one attempt at a scene has in hand, and the scene that comes out of it."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.poses.library import PoseLibrary
from synth.bodies.rig.kinematics import joint_positions
from synth.bodies.rig.skinning import pose_vertices
from synth.geometry import LabelledMesh
from synth.scene.config import SceneConfig
from synth.scene.placement import PlacedObject
from synth.scene.pools import Pools, Subject, is_among
from synth.vocabulary import PART

HANDS = frozenset(PART[f"{side}_{name}"] for side in "lr" for name in ("hand", "wrist"))
"""Labels of hands and wrists."""
FOREARMS = HANDS | frozenset(PART[name] for name in ("lw_arm", "rw_arm", "l_elbow", "r_elbow"))
"""Labels that touch tables, keyboards and handles."""
TORSO = frozenset(PART[name] for name in ("lu_torso", "ru_torso", "lw_torso", "rw_torso"))
"""Labels of the trunk."""
UPPER_ARMS = frozenset(PART[name] for name in ("lu_arm", "ru_arm"))
"""Labels of the upper arms."""
SEAT = frozenset(PART[name] for name in ("lw_torso", "rw_torso", "lu_torso", "ru_torso", "lu_leg", "ru_leg"))
"""Labels that a seat carries and its back holds."""
THIGHS = frozenset(PART[name] for name in ("lu_leg", "ru_leg", "l_knee", "r_knee"))
"""Labels that a laptop on the lap stands on."""


@dataclass(frozen=True)
class Person:
    """A subject in a pose: standing on the origin of the floor, facing x.

    Attributes:
        subject: Who.
        pose: Angles and root.
        vertices: (n_vertices, 3) float64 posed skin, world frame [m].
    """

    subject: Subject
    pose: Pose
    vertices: NDArray[np.float64]

    @staticmethod
    def in_pose(subject: Subject, pose: Pose) -> "Person":
        """Skins a subject in a pose."""
        return Person(subject, pose, pose_vertices(subject.body, pose).astype(np.float64))

    def face_centres_of(self, parts: frozenset[int]) -> NDArray[np.float64]:
        """(n, 3) centres of the faces that belong to these parts, world frame [m]."""
        a, b, c = self._corners_of(parts)
        return (a + b + c) / 3.0

    def face_planes_of(self, parts: frozenset[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n, 3) centres and (n, 3) outward unit normals of the faces that belong to these parts, world frame."""
        a, b, c = self._corners_of(parts)
        normals = np.cross(b - a, c - a)
        return (a + b + c) / 3.0, normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]

    def _corners_of(self, parts: frozenset[int]) -> NDArray[np.float64]:
        mesh = self.subject.body.mesh
        return self.vertices.take(mesh.faces.take(self.subject.faces_of(parts), axis=0).T, axis=0)

    def mesh(self) -> LabelledMesh:
        """The posed skin with its part labels."""
        bind = self.subject.body.mesh
        return LabelledMesh(self.vertices.astype(np.float32), bind.faces, bind.face_label, bind.is_closed)

    def joints(self) -> NDArray[np.float64]:
        """(15, 3) joint centres, world frame [m]."""
        return joint_positions(self.subject.body.skeleton, self.pose)

    def is_of(self, parts: frozenset[int]) -> NDArray[np.bool_]:
        """(n_vertices,) whether each vertex belongs to one of these parts."""
        return is_among(parts, self.subject.vertex_part)

    def points_of(self, parts: frozenset[int]) -> NDArray[np.float64]:
        """(n, 3) vertices that belong to these parts, world frame [m]."""
        return self.vertices.take(self.subject.vertices_of(parts), axis=0)

    def points_without(self, parts: frozenset[int]) -> NDArray[np.float64]:
        """(n, 3) vertices that do not belong to these parts, world frame [m]."""
        return self.vertices.take(self.subject.vertices_without(parts), axis=0)


@dataclass(frozen=True)
class Scene:
    """A posed person and the objects around them, before any camera sees them.

    Attributes:
        family: The scene family drawn.
        person: The person.
        objects: The objects, in the order of their instance numbers.
        visible_share: Range of the person's visible share that makes the scene what it is called.
        hides_person: Whether objects are meant to hide the person: the visible share is then within the configured
            range as well.
        azimuth: Bearing that the camera must have, because objects stand in its way; None if free [rad].
    """

    family: str
    person: Person
    objects: tuple[PlacedObject, ...] = ()
    visible_share: tuple[float, float] = (0.0, 1.0)
    hides_person: bool = True
    azimuth: float | None = None

    def with_objects(self, *more: PlacedObject) -> "Scene":
        """The scene with further objects."""
        return replace(self, objects=(*self.objects, *more))


@dataclass(frozen=True)
class SceneDraw:
    """One attempt at a scene: where its randomness, subjects and objects come from.

    Attributes:
        config: The corpus's scenes.
        pools: Subjects and objects.
        split: "train", "val" or "test".
        frame_idx: Number of the frame within its split.
        rng: The frame's randomness.
        library: Poses from motion capture that the person is taken from; None for procedural ones.
    """

    config: SceneConfig
    pools: Pools
    split: str
    frame_idx: int
    rng: np.random.Generator = field(repr=False)
    library: PoseLibrary | None = field(default=None, repr=False)

    def subject(self, is_seated: bool) -> Subject:
        """Draws the person, who sits or stands."""
        return self.pools.draw_subject(self.split, self.frame_idx, self.rng, is_seated)

    def place(
        self, class_name: str, T_world_object: NDArray[np.float64], kinds: tuple[str, ...] = ()
    ) -> PlacedObject:
        """Draws an object and puts it at a pose."""
        drawn = self.pools.draw_object(class_name, self.split, self.frame_idx, self.rng, kinds)
        return PlacedObject(drawn.spec_id, drawn.spec, drawn.occluder, T_world_object, drawn.surface)

    def gap(self) -> float:
        """Draws the distance between the surfaces of person and object [m]."""
        return float(self.rng.uniform(*self.config.clearance))
