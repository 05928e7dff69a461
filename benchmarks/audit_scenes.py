"""Counts scenes in which skin and objects sink into each other, with libigl's signed distances as the judge.

Both ways are measured: skin vertices against every closed object mesh's volume (its solids' sampled surface for
open ones is left to the other way), and points on every object's surface against the closed skin. Prints the
deepest overlap's distribution and the share of scenes over 1 cm, over all scenes and by family.

    python benchmarks/audit_scenes.py [--scenes 500] [--seed 0]
"""

import argparse
from collections import defaultdict

import igl
import numpy as np

from synth.bodies.skinning import posed_mesh
from synth.geometry import LabelledMesh, surface_points
from synth.occluders import registry
from synth.scene import FrameSource, SceneConfig
from synth.scene.replay import person_of

LIMIT = 0.01


def signed_distance(mesh: LabelledMesh, points: np.ndarray) -> np.ndarray:
    """Signed distance of points to a closed mesh by libigl, negative inside [m]."""
    return igl.signed_distance(
        points.astype(np.float64), mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    )[0]


def main() -> None:
    """Runs the audit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    source = FrameSource(SceneConfig(), options.seed, options.scenes)
    deepest: dict[str, list[float]] = defaultdict(list)
    for frame in source:
        body, pose = person_of(frame)
        skin = posed_mesh(body, pose)
        overlap = 0.0
        for record in frame.info.objects:
            mesh = registry.make(registry.from_plain(record.spec)).mesh.transformed(record.T_world_object)
            overlap = max(overlap, -float(signed_distance(skin, surface_points(mesh, 0.01)).min()))
            if mesh.is_closed:
                overlap = max(overlap, -float(signed_distance(mesh, skin.vertices).min()))
        deepest[frame.info.scene_family].append(overlap)
    everything = np.concatenate([np.array(values) for values in deepest.values()])
    print(f"{'family':14} scenes  over 1 cm   median     95 %      max  [mm]")
    for name, values in [*sorted(deepest.items()), ("all", everything)]:
        mm = 1000.0 * np.array(values)
        share = np.mean(mm > 1000.0 * LIMIT)
        print(
            f"{name:14} {len(mm):6} {share:9.1%} {np.median(mm):9.1f} {np.quantile(mm, 0.95):8.1f} {mm.max():8.1f}"
        )


if __name__ == "__main__":
    main()
