"""FrameSource: makes any frame of a corpus from (configuration, seed, split, number in the split) alone."""

from dataclasses import replace

import numpy as np

from synth.frame import Frame, FrameInfo, Moment, NumberedFrames
from synth.geometry import inverse, transform_points
from synth.render import backends
from synth.render.labels import Visibility, measure_visibility
from synth.render.records import RenderedPair, RenderObject
from synth.scene.bases import PoseMix
from synth.scene.clips.config import whole_scenes
from synth.scene.config import SceneConfig
from synth.scene.draw import Scene, SceneDraw
from synth.scene.families import SCENE_FAMILIES, draw_scene_family, without_context
from synth.scene.objects import ObjectMix
from synth.scene.placement import is_eye_free, record_of
from synth.scene.pools import Pools
from synth.scene.soundness import is_sound
from synth.scene.viewpoint import Viewpoint, draw_azimuth, draw_viewpoint, further_viewpoint
from synth.vocabulary import OCCLUDER_CODE, SPLITS

_FRAME_STREAM = 0
MAX_SCENES = 400
"""Attempts at a scene before a configuration is given up."""
MAX_LIBRARY_SCENES = 150
"""Attempts at a scene with captured poses before the frame takes a procedural one."""
MAX_VIEWS = 8
"""Viewpoints tried on one scene."""
MIN_BODY_PIXELS = 400
"""The person alone covers at least this many pixels."""

_Seen = tuple[Viewpoint, RenderedPair, Visibility]


class FrameSource(NumberedFrames[Frame]):
    """The frames of a corpus, in any order.

    The train frames come first, then val, then test. A frame depends on the configuration, the seed, its split
    and its number within the split, not on the number of frames.

    Args:
        config: What to draw from.
        seed: Corpus seed, 0..2**63 - 1.
        n_frames: Length of the corpus.
        renderer: Name of the renderer, "numba" or "pyrender".
        poses: Poses from motion capture among the procedural ones.
        objects: Imported objects among the procedural ones.
    """

    def __init__(
        self,
        config: SceneConfig,
        seed: int,
        n_frames: int,
        renderer: str = "numba",
        poses: PoseMix | None = None,
        objects: ObjectMix | None = None,
    ) -> None:
        super().__init__(seed, n_frames, whole_scenes(config.splits.counts, config.cameras))
        self.config = config
        self._camera = config.make_camera()
        self._renderer = backends.renderer(renderer, self._camera)
        self._pools = Pools(config, seed, objects)
        self._poses = poses
        self._last: tuple[tuple[str, int], tuple[Frame, ...]] | None = None

    @property
    def description(self) -> str:
        """Which back end and device draws, in words."""
        return self._renderer.description

    def frame(self, index: int) -> Frame:
        """Makes a frame.

        Args:
            index: 0..len(self) - 1.

        Raises:
            IndexError: There is no such frame.
            RuntimeError: No scene of the configuration passes its own conditions.
        """
        split, frame_idx = self.locate(index)
        scene_idx, view = divmod(frame_idx, self.config.cameras)
        if self._last is None or self._last[0] != (split, scene_idx) or self.config.cameras == 1:
            self._last = (split, scene_idx), self._frames(index - view, split, scene_idx)
        return self._last[1][view]

    def _frames(self, index: int, split: str, frame_idx: int) -> tuple[Frame, ...]:
        """The frames of all cameras of a scene, of which the first one's number in the corpus is given."""
        rng = np.random.default_rng([self.seed, _FRAME_STREAM, SPLITS.index(split), frame_idx])
        library = None if self._poses is None else self._poses.draw_library(split, rng)
        draw = SceneDraw(self.config, self._pools, split, frame_idx, rng, library)
        family = draw_scene_family(draw)
        for attempt in range(MAX_SCENES):
            if attempt == MAX_LIBRARY_SCENES:
                draw = replace(draw, library=None)
            scene = self._draw_scene(draw, family)
            if scene is None:
                continue
            seen = self._look(draw, scene)
            more = None if seen is None else self._look_further(draw, scene, seen[0])
            if seen is not None and more is not None:
                views = (seen, *more)
                return tuple(self._frame(index, k, draw, scene, *view) for k, view in enumerate(views))
        raise RuntimeError(
            f"frame {index} of seed {self.seed}: no {family!r} scene in {MAX_SCENES} attempts meets "
            f"clearance={self.config.clearance}, visible_share={self.config.visible_share} and the camera's ranges"
        )

    def _draw_scene(self, draw: SceneDraw, family: str) -> Scene | None:
        scene = SCENE_FAMILIES[family](draw)
        if scene is not None and not self.config.is_context_kept:
            pose_scene = SCENE_FAMILIES[draw_scene_family(draw)](draw)
            scene = None if pose_scene is None else without_context(draw, pose_scene, scene)
        return scene if scene is not None and is_sound(scene, self.config.clearance) else None

    def _look(self, draw: SceneDraw, scene: Scene) -> _Seen | None:
        """Draws viewpoints until one shows as much of the person as asked for."""
        joints = scene.person.joints()
        low, high = self._visible_share(scene)
        for _ in range(MAX_VIEWS):
            azimuth = draw_azimuth(self.config, draw.rng) if scene.azimuth is None else scene.azimuth
            viewpoint = draw_viewpoint(self.config, self._camera, joints, azimuth, draw.rng)
            seen = None if viewpoint is None else self._through(scene, viewpoint)
            if seen is not None and low <= seen[2].visible_fraction <= high:
                return seen
        return None

    def _look_further(self, draw: SceneDraw, scene: Scene, first: Viewpoint) -> tuple[_Seen, ...] | None:
        """What the cameras after the first one see; None if one of them does not see the person."""
        out = []
        for k in range(1, self.config.cameras):
            for _ in range(MAX_VIEWS):
                viewpoint = further_viewpoint(self.config, self._camera, scene.person.joints(), first, k, draw.rng)
                seen = None if viewpoint is None else self._through(scene, viewpoint)
                if seen is not None:
                    out.append(seen)
                    break
            else:
                return None
        return tuple(out)

    def _through(self, scene: Scene, viewpoint: Viewpoint) -> _Seen | None:
        """The scene from a viewpoint; None if the camera stands in an object or hardly sees the person."""
        if not is_eye_free(viewpoint.T_world_camera, scene.objects):
            return None
        objects = [
            RenderObject(item.occluder.mesh, OCCLUDER_CODE[item.occluder.class_name], k + 1, item.T_world_object)
            for k, item in enumerate(scene.objects)
        ]
        T_camera_world = inverse(viewpoint.T_world_camera)
        pair = self._renderer.render(T_camera_world, scene.person.mesh(), objects)
        if np.count_nonzero(pair.body_part) < MIN_BODY_PIXELS:
            return None
        joints = transform_points(T_camera_world, scene.person.joints())
        return viewpoint, pair, measure_visibility(pair, joints, self._camera)

    def _visible_share(self, scene: Scene) -> tuple[float, float]:
        """The scene's own range, within the configured one if objects are meant to hide the person."""
        low, high = scene.visible_share
        if not scene.hides_person:
            return low, high
        return max(low, self.config.visible_share[0]), min(high, self.config.visible_share[1])

    def _frame(
        self,
        first: int,
        view: int,
        draw: SceneDraw,
        scene: Scene,
        viewpoint: Viewpoint,
        pair: RenderedPair,
        labels: Visibility,
    ) -> Frame:
        person = scene.person
        joints = transform_points(inverse(viewpoint.T_world_camera), person.joints())
        info = FrameInfo(
            seed=self.seed,
            index=first + view,
            split=draw.split,
            subject_id=person.subject.subject_id,
            subject=person.subject.spec,
            scene_family=scene.family,
            pose_family=person.pose.family,
            pose_id=person.pose.source_id or f"pose/{draw.split}/{draw.frame_idx:07d}",
            visible_fraction=labels.visible_fraction,
            objects=tuple(
                record_of(item, k + 1, float(labels.object_visible_fraction[k + 1]))
                for k, item in enumerate(scene.objects)
            ),
        )
        return Frame(
            depth=pair.depth,
            part=pair.part,
            occluder=pair.occluder,
            instance=pair.instance,
            body_depth=pair.body_depth,
            body_part=pair.body_part,
            joints=joints.astype(np.float32),
            joint_state=labels.joint_state,
            joint_visible_fraction=labels.joint_visible_fraction,
            part_visible_fraction=labels.part_visible_fraction,
            angles=person.pose.angles.astype(np.float32),
            T_world_root=person.pose.T_world_root,
            T_world_camera=viewpoint.T_world_camera,
            camera=self._camera,
            info=info,
            moment=None if self.config.cameras == 1 else Moment(draw.frame_idx, 0, view),
        )
