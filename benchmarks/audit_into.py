"""How near objects before recorded people come to skin that no pixel shows, on people whose skin is known.

    python benchmarks/audit_into.py [--frames 300]

Generated people, without furniture or at tables that are taken away, seen from within 60 degrees of their front,
are taken for recorded ones: objects are put before them by their depth image alone. Then the distance of the
objects' solids to all vertices of the skin is measured.
"""

import argparse
from dataclasses import replace

import numpy as np

from synth.bodies.rig.skinning import pose_vertices
from synth.frame import Frame
from synth.occluders import registry
from synth.occluders.solids.distance import solid_distances
from synth.scene import FrameSource, SceneConfig, SceneWeights
from synth.scene.composed import ComposeConfig, Composer
from synth.scene.replay import person_of

GROUPS = {
    "without furniture": SceneWeights(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "at a table": SceneWeights(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}


def alone(frame: Frame) -> Frame:
    """The frame as if it had been recorded without objects."""
    nothing = np.zeros_like(frame.part)
    info = replace(frame.info, objects=(), visible_fraction=1.0)
    return replace(
        frame, depth=frame.body_depth, part=frame.body_part, occluder=nothing, instance=nothing, info=info
    )


def gap_to_skin(frame: Frame) -> float:
    """Smallest distance of any object to any vertex of the skin [m]; negative inside an object."""
    skin = pose_vertices(*person_of(frame)).astype(np.float64)
    solids = ((registry.make(registry.from_plain(item.spec)).solids, item) for item in frame.info.objects)
    return min(float(solid_distances(solid, item.T_world_object, skin).min()) for solid, item in solids)


def main() -> None:
    """Runs the audit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=300)
    options = parser.parse_args()
    for name, weights in GROUPS.items():
        config = SceneConfig(scenes=weights, camera="kinect_v1_qvga", azimuth=(-1.047, 1.047))
        source, composer = FrameSource(config, 0, options.frames), Composer(ComposeConfig(), 0, np.eye(4))
        gaps, is_whole = [], []
        for index in range(options.frames):
            recorded = alone(source.frame(index))
            frame = composer.compose(recorded, index, index)
            if frame.info.objects:
                gaps.append(gap_to_skin(frame))
                is_whole.append(
                    not recorded.body_depth[[0, -1]].any() and not recorded.body_depth[:, [0, -1]].any()
                )
        for label, group in (("whole in the image", np.array(is_whole)), ("cut off by it", ~np.array(is_whole))):
            found = 1e3 * np.array(gaps)[group]
            if len(found):
                print(
                    f"{name}, {label}: {len(found)} frames, gap min, 1, 5, 50 % = "
                    f"{', '.join(f'{v:.1f}' for v in np.percentile(found, (0, 1, 5, 50)))} mm; "
                    f"{(found < 0).sum()} touch, {(found < -10).sum()} by over 1 cm"
                )


if __name__ == "__main__":
    main()
