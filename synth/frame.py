"""Frame: what synth gives out, one labelled depth image with its joints and camera."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.vocabulary import SPLITS

FrameT = TypeVar("FrameT")


@dataclass(frozen=True)
class Moment:
    """Which clip a frame belongs to, when in it, and through which camera it is seen.

    Attributes:
        clip: Number of the clip within its split; where single scenes are seen by several cameras, of the scene.
        time: Number of the time step in the clip, from 0; steps are `scene.fps` a second.
        view: Number of the camera, from 0.
    """

    clip: int
    time: int
    view: int


@dataclass(frozen=True)
class PersonMotion:
    """How a person of a clip moves.

    Attributes:
        joints_world: (15, 3) float32 joint centres, world frame [m]; the same for all cameras.
        velocity: (15, 3) float32 their velocities, world frame [m/s].
        contacts: (n_contacts,) uint8 1 where something touches, in the order of `CONTACT_NAMES`.
    """

    joints_world: NDArray[np.float32]
    velocity: NDArray[np.float32]
    contacts: NDArray[np.uint8]


@dataclass(frozen=True)
class ObjectRecord:
    """One object of a frame.

    Attributes:
        instance: Its number in the frame's `instance` image, from 1.
        class_name: Its occluder class.
        spec_id: Identifier of the object's spec in the corpus ("table/train/0003"); splits never share one.
        spec: The spec's fields, as plain JSON values, with "kind" naming the generator.
        T_world_object: (4, 4) as nested tuples.
        visible_fraction: Pixels seen in the composite over pixels of the object alone; 0 if it covers none.
        contacts: Names of the body parts that may touch it; all others keep the clearance.
    """

    instance: int
    class_name: str
    spec_id: str
    spec: dict[str, object]
    T_world_object: tuple[tuple[float, ...], ...]
    visible_fraction: float
    contacts: tuple[str, ...] = ()


@dataclass(frozen=True)
class FrameInfo:
    """Everything about a frame that is not an array.

    Attributes:
        seed: The corpus seed.
        index: The frame's number in the corpus; (seed, index) alone make the frame.
        split: "train", "val" or "test".
        subject_id: Identifier of the body ("subject/train/0007").
        subject: The BodySpec's fields as plain JSON values.
        scene_family: Which kind of scene ("table", "laptop_lap", ...).
        pose_family: Which kind of pose ("writing", ...).
        pose_id: Identifier of the pose draw, or of the captured pose; splits never share one.
        visible_fraction: Person's pixels in the composite over those of the body alone.
        objects: The objects, in order of instance.
    """

    seed: int
    index: int
    split: str
    subject_id: str
    subject: dict[str, object]
    scene_family: str
    pose_family: str
    pose_id: str
    visible_fraction: float
    objects: tuple[ObjectRecord, ...] = ()


@dataclass(frozen=True)
class Frame:
    """One labelled depth image: two layers of one scene seen by one camera.

    The composite is what the sensor sees; the body layer is the person without the objects.

    Attributes:
        depth: (height, width) uint16 composite depth along the optical axis [mm], 0 = nothing.
        part: (height, width) uint8 composite body part 1..31, 0 elsewhere.
        occluder: (height, width) uint8 composite occluder class code, 0 elsewhere.
        instance: (height, width) uint8 composite object number, 0 elsewhere.
        body_depth: (height, width) uint16 depth of the person alone [mm].
        body_part: (height, width) uint8 parts of the person alone.
        joints: (15, 3) float32 joint centres, camera frame [m]; NaN where, and only where, the state is UNKNOWN.
        joint_state: (15,) uint8 `JointState`.
        joint_visible_fraction: (15,) float32, share of the surface over the joint that the composite shows.
        part_visible_fraction: (32,) float32 by part label: composite pixels over body-alone pixels; 0 where none.
        angles: (n_dof,) float32 joint angles of the skeleton [rad].
        T_world_root: (4, 4) float64, pose of the body's root.
        T_world_camera: (4, 4) float64, pose of the camera.
        camera: Intrinsics.
        info: Everything else.
        moment: Scene and view, of corpora with several cameras.
    """

    depth: NDArray[np.uint16]
    part: NDArray[np.uint8]
    occluder: NDArray[np.uint8]
    instance: NDArray[np.uint8]
    body_depth: NDArray[np.uint16]
    body_part: NDArray[np.uint8]
    joints: NDArray[np.float32]
    joint_state: NDArray[np.uint8]
    joint_visible_fraction: NDArray[np.float32]
    part_visible_fraction: NDArray[np.float32]
    angles: NDArray[np.float32]
    T_world_root: NDArray[np.float64]
    T_world_camera: NDArray[np.float64]
    camera: Camera
    info: FrameInfo = field(repr=False)
    moment: Moment | None = None

    @property
    def joints_2d(self) -> NDArray[np.float64]:
        """(15, 2) float64 joint centres [px]; NaN where the state is UNKNOWN."""
        return self.camera.project(self.joints)


class NumberedFrames(Generic[FrameT]):
    """Frames of a corpus in any order: train, then val, then test; subclasses make them.

    Attributes:
        seed: Corpus seed.
        counts: Frames of each split.
    """

    def __init__(self, seed: int, n_frames: int, counts: Callable[[int], tuple[int, ...]]) -> None:
        """Checks what the frames are numbered by.

        Args:
            seed: Corpus seed, 0..2**63 - 1.
            n_frames: Length of the corpus, at least 1.
            counts: Divides it among the splits.
        """
        if not 0 <= seed < 2**63:
            raise ValueError(f"seed={seed} must be in 0..2**63 - 1")
        if n_frames < 1:
            raise ValueError(f"n_frames={n_frames} must be at least 1")
        self.seed, self.counts = seed, counts(n_frames)

    def __len__(self) -> int:
        return sum(self.counts)

    def __iter__(self) -> Iterator[FrameT]:
        return (self.frame(index) for index in range(len(self)))

    def frame(self, index: int) -> FrameT:
        """Makes a frame; see the subclass."""
        raise NotImplementedError

    def split_of(self, index: int) -> str:
        """Name of the split that frame `index` belongs to."""
        return self.locate(index)[0]

    def locate(self, index: int) -> tuple[str, int]:
        """The split of frame `index`, and its number in it.

        Raises:
            IndexError: There is no such frame.
        """
        if not 0 <= index < len(self):
            raise IndexError(f"frame {index} must be in 0..{len(self) - 1}")
        for split, count in zip(SPLITS, self.counts, strict=True):
            if index < count:
                return split, index
            index -= count
        raise AssertionError("counts do not add up")


@dataclass(frozen=True)
class PersonRecord:
    """One person of a whole scene, but for the arrays.

    Attributes:
        number: Their number in the frame's `person` image, from 1.
        subject_id: Identifier of the body; nobody is in a frame twice.
        subject: The BodySpec's fields as plain JSON values.
        pose_family: Which kind of pose.
        pose_id: Identifier of the pose draw, or of the captured pose; splits never share one.
        group: What they do with others: "alone", "facing", "queue", "table" or "passing".
        group_number: People of one group share it; from 1.
        activity: The scene family for who is alone ("unhidden", "laptop_table", ...); else the group's name.
        seat: Instance of the object that they sit on; 0 if none.
        visible_fraction: Their pixels in the composite over those of their body alone; 0 if it has none.
    """

    number: int
    subject_id: str
    subject: dict[str, object]
    pose_family: str
    pose_id: str
    group: str
    group_number: int
    activity: str
    seat: int
    visible_fraction: float


@dataclass(frozen=True)
class RoomInfo:
    """Everything about a whole scene that is not an array.

    Attributes:
        seed: The corpus seed.
        index: The frame's number in the corpus; (seed, index) alone make the frame.
        split: "train", "val" or "test".
        room_id: Identifier of the room ("room/living/train/00003"); splits never share one.
        room: The RoomSpec's fields as plain JSON values.
        people: The people, in order of number.
        objects: Surfaces, furniture of the room and objects of the people, in order of instance.
    """

    seed: int
    index: int
    split: str
    room_id: str
    room: dict[str, object]
    people: tuple[PersonRecord, ...] = ()
    objects: tuple[ObjectRecord, ...] = ()


@dataclass(frozen=True)
class PersonView:
    """One person of a whole scene, as arrays.

    Attributes:
        box: (left, top, width, height) of the crops in the image [px]; all 0 if the image shows nothing of them.
        body_depth: (height, width) uint16 crop: depth of the person alone [mm], 0 = nothing.
        body_part: (height, width) uint8 crop: parts of the person alone.
        joints: (15, 3) float32 joint centres, camera frame [m].
        joint_state: (15,) uint8 `JointState`.
        joint_visible_fraction: (15,) float32, share of the surface over the joint that the composite shows.
        part_visible_fraction: (32,) float32 by part label: composite pixels over body-alone pixels; 0 where none.
        angles: (n_dof,) float32 joint angles of the skeleton [rad].
        T_world_root: (4, 4) float64, pose of the body's root.
        motion: How they move, in clips.
    """

    box: tuple[int, int, int, int]
    body_depth: NDArray[np.uint16]
    body_part: NDArray[np.uint8]
    joints: NDArray[np.float32]
    joint_state: NDArray[np.uint8]
    joint_visible_fraction: NDArray[np.float32]
    part_visible_fraction: NDArray[np.float32]
    angles: NDArray[np.float32]
    T_world_root: NDArray[np.float64]
    motion: PersonMotion | None = None

    @property
    def window(self) -> tuple[slice, slice]:
        """Rows and columns of the crops in the image."""
        left, top, width, height = self.box
        return slice(top, top + height), slice(left, left + width)


@dataclass(frozen=True)
class RoomFrame:
    """One labelled depth image of a whole scene: a room, the people in it, and what is seen of each of them alone.

    Every pixel with depth belongs to a part of one person, or to an object or a surface, and no other has a label.

    Attributes:
        depth: (height, width) uint16 composite depth along the optical axis [mm], 0 = nothing.
        part: (height, width) uint8 composite body part 1..31, 0 elsewhere.
        person: (height, width) uint8 number of the person, 0 elsewhere.
        occluder: (height, width) uint8 code in `SCENE_CLASSES` of objects and surfaces, 0 elsewhere.
        instance: (height, width) uint8 number of the object or surface, 0 elsewhere.
        people: The people, in order of number.
        T_world_camera: (4, 4) float64, pose of the camera; the world's origin is the middle of the room's floor.
        camera: Intrinsics.
        info: Everything else.
        moment: Clip, time and view, of clips and of corpora with several cameras.
    """

    depth: NDArray[np.uint16]
    part: NDArray[np.uint8]
    person: NDArray[np.uint8]
    occluder: NDArray[np.uint8]
    instance: NDArray[np.uint8]
    people: tuple[PersonView, ...]
    T_world_camera: NDArray[np.float64]
    camera: Camera
    info: RoomInfo = field(repr=False)
    moment: Moment | None = None

    def joints_2d(self, k: int) -> NDArray[np.float64]:
        """(15, 2) float64 joint centres of person k, counted from 0 [px]."""
        return self.camera.project(self.people[k].joints)
