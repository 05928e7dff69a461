"""Composer: lays drawn objects over a recorded frame, made from (settings, seed, split, number, frame) alone."""

from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.frame import Frame
from synth.geometry import inverse
from synth.render import backends
from synth.render.labels import measure_visibility
from synth.render.overlay import as_measured, lay_over
from synth.render.records import Backend, RenderedPair, RenderObject
from synth.scene.composed.config import ComposeConfig
from synth.scene.composed.furniture import FAMILIES
from synth.scene.composed.person import RecordedPerson, person_of
from synth.scene.draw import SceneDraw
from synth.scene.objects import ObjectMix
from synth.scene.placement import Assembly, is_eye_free, record_of
from synth.scene.pools import Pools
from synth.vocabulary import OCCLUDER_CODE, SPLITS, JointState

UNHIDDEN = "unhidden"
_FRAME_STREAM, _NOISE_STREAM = 3, 4
"""Kept apart from those of generated frames, subjects and objects."""
MAX_SCENES = 60
"""Attempts at a frame's objects before the person stays unhidden."""
MAX_OF_FAMILY = 20
"""Attempts before another family is drawn."""
EYE_ROOM = 0.6
"""The camera keeps this far from objects: nearer than half a metre, most sensors see nothing [m]."""
CANDIDATES = 3
"""Of so many scenes, the one whose visible share is nearest to a drawn one is taken: most hide little."""


@dataclass(frozen=True)
class _Candidate:
    """Objects that stand before the person, and what the camera makes of them.

    Attributes:
        family: Their family.
        objects: In order of instance, scene frame.
        drawn: Their images, without the person.
        visible_share: Of the person.
    """

    family: str
    objects: Assembly
    drawn: RenderedPair
    visible_share: float


class Composer:
    """Puts objects before recorded people.

    Args:
        config: What to draw from.
        seed: Corpus seed, 0..2**63 - 1.
        T_floor_world: (4, 4) from the recording's world to one whose ground plane z = 0 is the floor.
        renderer: Name of the renderer.
        objects: Imported objects among the procedural ones.
    """

    def __init__(
        self,
        config: ComposeConfig,
        seed: int,
        T_floor_world: NDArray[np.float64],
        renderer: str = "numba",
        objects: ObjectMix | None = None,
    ) -> None:
        if not 0 <= seed < 2**63:
            raise ValueError(f"seed={seed} must be in 0..2**63 - 1")
        self.config = config
        self.seed = seed
        self.T_floor_world = T_floor_world
        self._drawing = config.drawing()
        self._pools = Pools(self._drawing, seed, objects)
        self._renderer_name = renderer
        self._renderers: dict[Camera, Backend] = {}

    def renderer(self, camera: Camera) -> Backend:
        """What draws the objects for a camera."""
        if camera not in self._renderers:
            self._renderers[camera] = backends.renderer(self._renderer_name, camera)
        return self._renderers[camera]

    def compose(self, frame: Frame, index: int, frame_idx: int) -> Frame:
        """A recorded frame with objects before the person; without any if none fit.

        Args:
            frame: The recorded frame.
            index: Number of the new frame in its corpus.
            frame_idx: Its number in its split.
        """
        split = frame.info.split
        T_world_camera = self.T_floor_world @ frame.T_world_camera
        T_world_root = self.T_floor_world @ frame.T_world_root
        moved = replace(
            frame,
            T_world_camera=T_world_camera,
            T_world_root=T_world_root,
            info=replace(frame.info, seed=self.seed, index=index, scene_family=UNHIDDEN),
        )
        if not frame.body_depth.any():
            return moved
        stream = [SPLITS.index(split), frame_idx]
        rng = np.random.default_rng([self.seed, _FRAME_STREAM, *stream])
        draw = SceneDraw(self._drawing, self._pools, split, frame_idx, rng)
        person = person_of(frame, T_world_camera, T_world_root)
        chosen = self._choose(draw, frame, person)
        if chosen is None:
            return moved
        noise = np.random.default_rng([self.seed, _NOISE_STREAM, *stream])
        return self._framed(moved, person, chosen, noise)

    def _choose(self, draw: SceneDraw, frame: Frame, person: RecordedPerson) -> _Candidate | None:
        """Draws scenes of a family and takes the one that hides most nearly as much as drawn."""
        family = _draw_family(self.config, draw.rng)
        low, high = self.config.visible_share
        wanted = float(draw.rng.uniform(low, high))
        found: list[_Candidate] = []
        for attempt in range(MAX_SCENES):
            if attempt and attempt % MAX_OF_FAMILY == 0:
                if found:
                    break
                family = _draw_family(self.config, draw.rng)
            attempt_objects = FAMILIES[family]
            if attempt_objects is None:
                return None
            objects = attempt_objects(draw, person)
            if objects is None or not is_eye_free(inverse(person.T_camera_scene), objects, EYE_ROOM):
                continue
            candidate = self._look(family, objects, frame, person)
            if low <= candidate.visible_share <= high:
                found.append(candidate)
            if len(found) == CANDIDATES:
                break
        return min(found, key=lambda item: abs(item.visible_share - wanted), default=None)

    def _look(self, family: str, objects: Assembly, frame: Frame, person: RecordedPerson) -> _Candidate:
        things = [
            RenderObject(item.occluder.mesh, OCCLUDER_CODE[item.occluder.class_name], k + 1, item.T_world_object)
            for k, item in enumerate(objects)
        ]
        drawn = self.renderer(frame.camera).render(person.T_camera_scene, None, things)
        pair = lay_over(frame.body_depth, frame.body_part, drawn)
        share = np.count_nonzero(pair.part) / np.count_nonzero(pair.body_part)
        return _Candidate(family, objects, drawn, float(share))

    def _framed(
        self, frame: Frame, person: RecordedPerson, chosen: _Candidate, noise: np.random.Generator
    ) -> Frame:
        drawn = as_measured(chosen.drawn, frame.body_depth, self.config.sensor, frame.camera, noise)
        pair = lay_over(frame.body_depth, frame.body_part, drawn)
        seen = measure_visibility(pair, frame.joints, frame.camera)
        is_known = frame.joint_state != JointState.UNKNOWN
        placed = (
            replace(item, T_world_object=person.T_world_scene @ item.T_world_object) for item in chosen.objects
        )
        info = replace(
            frame.info,
            scene_family=chosen.family,
            visible_fraction=seen.visible_fraction,
            objects=tuple(
                record_of(item, k, float(seen.object_visible_fraction[k]))
                for k, item in enumerate(placed, start=1)
            ),
        )
        return replace(
            frame,
            depth=pair.depth,
            part=pair.part,
            occluder=pair.occluder,
            instance=pair.instance,
            joint_state=np.where(is_known, seen.joint_state, JointState.UNKNOWN).astype(np.uint8),
            joint_visible_fraction=np.where(is_known, seen.joint_visible_fraction, 0).astype(np.float32),
            part_visible_fraction=seen.part_visible_fraction,
            info=info,
        )


def _draw_family(config: ComposeConfig, rng: np.random.Generator) -> str:
    names, weights = zip(*asdict(config.scenes).items(), strict=True)
    return str(names[int(rng.choice(len(names), p=np.array(weights) / sum(weights)))])
