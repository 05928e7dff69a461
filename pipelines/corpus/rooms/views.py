"""Whole scenes as the forests' sequence of frames: every person of a scene is a frame, cut out at a place."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.finder.cutting import cut_axis
from forests.finder.find import FoundPerson, PeopleFinder
from forests.finder.floor import Floor
from forests.frames import DepthFrame, LabelTable
from pipelines.corpus.read import Corpus
from pipelines.corpus.rooms.matching import DISTANCES, MIN_VISIBLE, floor_of, judge_axes, truths_of
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import CorpusError
from synth.frame import RoomFrame
from synth.vocabulary import JOINT_NAMES, MAX_PEOPLE, OCCLUDER_CLASSES, JointState

Place = Literal["near", "true", "found", "mask"]
"""Where a person is cut out: near the true place, as far off as a finder is; at the true place; where the finder finds
them, an empty image if it does not; or by the true mask of the person and the objects about them, without the room."""
CROWN_M = 0.12
"""The top of a head is this far above its joint [m]."""
AWAY_M, LEVEL_SD_M, HEIGHT_M, HEIGHT_SD_M = 0.045, 0.046, 0.08, 0.086
"""Axes of the finder lie this far behind the head's joint, spread so far in either level direction, and the tops this
far above it: means and standard deviations of 307 people whom it found in 120 frames of val, with random noise [m]."""
OTHER_PEOPLE = "people"
"""Name of the label of everybody but the one whom a frame is about."""
_PLACE_STREAM = 0x9ACE
_HEAD, _TORSO = JOINT_NAMES.index("head"), JOINT_NAMES.index("torso")
_HIDDEN = (JointState.OCCLUDED, JointState.OCCLUDED_BY_PERSON)


class _Scene(NamedTuple):
    """A scene as a sensor shows it, its floor, and who the finder has found, if it was asked."""

    frame: RoomFrame
    floor: Floor
    found: tuple[FoundPerson, ...]
    found_floor: Floor | None
    owner: NDArray[np.int64]


@dataclass(frozen=True)
class PeopleFrames:
    """People of whole scenes, read one at a time.

    Attributes:
        corpus: An open corpus of rooms.
        people: (n, 2) int64, frame number and number of the person from 0, see `people_of`.
        sensor: Sensor model for the composite's depth; None = clean.
        place: Where people are cut out.
    """

    corpus: Corpus
    people: NDArray[np.int64]
    sensor: str | None = None
    place: Place = "near"

    def __post_init__(self) -> None:
        if not self.corpus.header.has_rooms:
            raise CorpusError(f"{self.corpus.path} holds single people, who need not be cut out")

    @property
    def indices(self) -> NDArray[np.int64]:
        """(n,) frame number of each person."""
        return self.people[:, 0]

    @property
    def labels(self) -> LabelTable:
        """What the label images mean: classes of objects hide, surfaces and other people are surroundings."""
        tables = self.corpus.header.labels
        n_objects = len(OCCLUDER_CLASSES)
        surroundings = (*tables["occluders"][n_objects:], OTHER_PEOPLE)
        return LabelTable(
            tuple(tables["parts"][1:]),
            tuple(tables["occluders"][1:n_objects]),
            tuple(tables["joints"]),
            surroundings,
        )

    def __len__(self) -> int:
        return len(self.people)

    def __getitem__(self, place: int) -> DepthFrame:
        number, k = (int(value) for value in self.people[place])
        scene = self._scene(number)
        frame, view = scene.frame, scene.frame.people[k]
        depth, box = self._image(scene, number, k)
        n_parts = self.labels.n_parts
        is_own = frame.person == k + 1
        label = np.where(frame.occluder > 0, frame.occluder + np.uint8(n_parts), 0)
        label = np.where(frame.person > 0, np.where(is_own, frame.part, self.labels.n_labels), label)
        body_depth, body_label = np.zeros_like(frame.depth), np.zeros_like(frame.part)
        body_depth[view.window], body_label[view.window] = view.body_depth, view.body_part
        return DepthFrame(
            depth,
            (label * (depth > 0)).astype(np.uint8),
            body_depth,
            body_label,
            view.joints,
            np.isin(view.joint_state, _HIDDEN),
            frame.camera,
            box=box,
        )

    def _image(self, scene: _Scene, number: int, k: int) -> tuple[NDArray[np.uint16], Box | None]:
        """The depth of a person cut out, and the box that a detector gives, if that is not the true one."""
        frame = scene.frame
        if self.place == "mask":
            near = cut_axis(frame.depth, frame.camera, _axes(frame, scene.floor, None)[k : k + 1], 0, scene.floor)
            is_object = (frame.occluder > 0) & (frame.occluder < len(OCCLUDER_CLASSES)) & (near > 0)
            return frame.depth * ((frame.person == k + 1) | is_object), None
        if self.place == "found":
            at = np.flatnonzero(scene.owner == k)
            if not len(at):
                return np.zeros_like(frame.depth), None
            axes = np.array([person.axis for person in scene.found])
            cut = cut_axis(frame.depth, frame.camera, axes, int(at[0]), scene.found_floor)
            return cut, scene.found[int(at[0])].upper_body
        rng = np.random.default_rng([self.corpus.header.seed, number, _PLACE_STREAM])
        axes = _axes(frame, scene.floor, rng if self.place == "near" else None)
        seen = [j for j in range(len(axes)) if j == k or (frame.person == j + 1).any()]
        return cut_axis(frame.depth, frame.camera, axes[seen], seen.index(k), scene.floor), None

    @functools.cached_property
    def _scene(self) -> Callable[[int], _Scene]:
        """Reads a scene; the few that were read last are kept, for their other people."""
        finder = PeopleFinder() if self.place == "found" else None

        @functools.lru_cache(maxsize=16)
        def read(number: int) -> _Scene:
            frame = self.corpus.scene(number, self.sensor)
            floor = floor_of(frame)
            if finder is None:
                return _Scene(frame, floor, (), None, np.zeros(0, np.int64))
            found = finder.find(frame.depth, frame.camera)
            return _Scene(frame, floor, found.people, found.floor, _owners(frame, found.people))

        return read


def frames_shown(
    corpus: Corpus, numbers: NDArray[np.int64], sensor: str | None = None, place: Place | None = None
) -> CorpusFrames | PeopleFrames:
    """Frames of single people, or, at a place, everybody in whole scenes who ought to be found.

    Args:
        corpus: An open corpus.
        numbers: (n,) frame numbers.
        sensor: Sensor model for the depth; None = clean.
        place: Where people are cut out; None for a corpus of single people.
    """
    if place is None:
        return CorpusFrames(corpus, numbers, sensor)
    return PeopleFrames(corpus, people_of(corpus, numbers), sensor, place)


def _axes(frame: RoomFrame, floor: Floor, rng: np.random.Generator | None) -> NDArray[np.float64]:
    """(n_people, 3) points on the axes of all people at the height of their tops, camera frame [m]; a draw for each."""
    heads = np.array([view.joints[_HEAD] for view in frame.people], np.float64).reshape(-1, 3)
    if rng is None:
        return heads + CROWN_M * floor.normal
    rise = heads @ floor.normal
    ahead = heads - rise[:, None] * floor.normal
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    side = np.cross(floor.normal, ahead)
    off = rng.normal(0.0, 1.0, (len(heads), 3)) * (LEVEL_SD_M, LEVEL_SD_M, HEIGHT_SD_M) + (AWAY_M, 0.0, HEIGHT_M)
    return heads + off[:, :1] * ahead + off[:, 1:2] * side + off[:, 2:] * floor.normal


def _owners(frame: RoomFrame, found: tuple[FoundPerson, ...]) -> NDArray[np.int64]:
    """(n_found,) int64: the person whom each place is of; -1 = nobody."""
    return judge_axes(truths_of(frame), [person.axis for person in found], frame.T_world_camera).person


def people_of(corpus: Corpus, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Who of some scenes is a frame: those who ought to be found, 1 to 5 m away and at least a quarter visible.

    Returns:
        (n, 2) int64, frame number and number of the person from 0, in order of the numbers given.
    """
    if not len(numbers):
        return np.zeros((0, 2), np.int64)
    joints, state = corpus.arrays("joints", numbers), corpus.arrays("joint_state", numbers)
    poses = corpus.arrays("T_world_camera", numbers)
    is_inside = (state != JointState.OUTSIDE).mean(axis=2)
    chosen = []
    for row, number in enumerate(numbers.tolist()):
        record, T = corpus.scene_record(number), poses[row]
        for k, person in enumerate(record.people[:MAX_PEOPLE]):
            torso = T[:3, :3] @ joints[row, k, _TORSO].astype(np.float64)
            is_near = DISTANCES[0] <= float(np.hypot(torso[0], torso[1])) <= DISTANCES[1]
            if is_near and person.visible_fraction * is_inside[row, k] >= MIN_VISIBLE:
                chosen.append((number, k))
    return np.array(chosen, np.int64).reshape(-1, 2)
