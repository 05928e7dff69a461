"""Counts scenes in which skin and objects sink into each other, with libigl's signed distances as the judge.

Both ways are measured: skin vertices against every closed object mesh's volume (its solids' sampled surface for
open ones is left to the other way), and points on every object's surface against the closed skin. Prints the
deepest overlap's distribution and the share of scenes over 1 cm, over all scenes and by family.

    python benchmarks/audit_scenes.py [--scenes 500] [--seed 0] [--config FILE.toml] [--poses FILE] [--objects FILE]
        [--split test]

With libraries of recorded poses or imported objects, all frames are of one split and take all they can from them.
"""

import argparse
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import igl
import numpy as np
from tqdm import tqdm

from pipelines.commands.generate import GenerateSettings
from synth.bodies.poses.library import read_library as read_poses
from synth.bodies.rig.skinning import posed_mesh
from synth.frame import Frame
from synth.geometry import LabelledMesh, surface_points
from synth.occluders.meshlib import IMPORTED, MeshLibrary
from synth.occluders.meshlib import read_library as read_objects
from synth.scene import FrameSource, SceneConfig
from synth.scene.bases import PoseMix
from synth.scene.config import SplitShares
from synth.scene.objects import ObjectMix
from synth.scene.replay import occluder_of, person_of
from synth.vocabulary import SPLITS

LIMIT = 0.01


def signed_distance(mesh: LabelledMesh, points: np.ndarray) -> np.ndarray:
    """Signed distance of points to a closed mesh by libigl, negative inside [m]."""
    return igl.signed_distance(
        points.astype(np.float64), mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    )[0]


def audit(frame: Frame, library: MeshLibrary | None) -> tuple[float, list[float], list[float]]:
    """Measures one scene.

    Args:
        frame: Its frame.
        library: Where imported objects come from.

    Returns:
        Deepest overlap of skin and objects [m]; smallest gap to each object that nothing may touch, and that
        stands on the floor; smallest gap to each object that has contacts.
    """
    body, pose = person_of(frame)
    skin = posed_mesh(body, pose)
    overlap, clear, touched = 0.0, [], []
    for record in frame.info.objects:
        mesh = occluder_of(record, library).mesh.transformed(record.T_world_object)
        gap = float(signed_distance(skin, surface_points(mesh, 0.01)).min())
        if mesh.is_closed:
            gap = min(gap, float(signed_distance(mesh, skin.vertices).min()))
        overlap = max(overlap, -gap)
        if record.contacts:
            touched.append(gap)
        elif abs(record.T_world_object[2][3]) < 1e-6:
            clear.append(gap)
    return overlap, clear, touched


def main() -> None:
    """Runs the audit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--config", type=Path, help="settings of `undergrowth generate` with the scenes to draw")
    parser.add_argument("--poses", type=Path)
    parser.add_argument("--objects", type=Path)
    parser.add_argument("--split", choices=SPLITS, default="test")
    options = parser.parse_args()
    config = SceneConfig() if options.config is None else GenerateSettings.from_toml(options.config).scene
    poses, objects = None, None
    if options.poses or options.objects:
        config = replace(config, splits=SplitShares(*[float(split == options.split) for split in SPLITS]))
    if options.poses:
        poses = PoseMix(read_poses(options.poses), 1.0, (options.split,))
    if options.objects:
        objects = ObjectMix(read_objects(options.objects), 1.0, (options.split,))
    library = None if objects is None else objects.library
    source = FrameSource(config, options.seed, options.scenes, poses=poses, objects=objects)
    overlaps: dict[str, list[float]] = defaultdict(list)
    clear: dict[str, list[float]] = defaultdict(list)
    touched = []
    n_recorded, n_imported, n_objects = 0, 0, 0
    for frame in tqdm(source, total=options.scenes, mininterval=2.0):
        n_recorded += frame.info.pose_id.startswith("mocap/")
        n_imported += sum(record.spec["kind"] == IMPORTED for record in frame.info.objects)
        n_objects += len(frame.info.objects)
        overlap, clear_here, touched_here = audit(frame, library)
        overlaps[frame.info.scene_family].append(overlap)
        clear[frame.info.scene_family] += clear_here
        touched += touched_here
    everything = np.concatenate([np.array(values) for values in overlaps.values()])
    print(f"{options.scenes} scenes, {n_recorded} of recorded poses; {n_imported} of {n_objects} objects imported")
    print("deepest overlap of skin and objects")
    print(f"{'family':14} scenes  over 1 cm   median     95 %      max  [mm]")
    for name, values in [*sorted(overlaps.items()), ("all", everything)]:
        mm = 1000.0 * np.array(values)
        share = np.mean(mm > 1000.0 * LIMIT)
        print(
            f"{name:14} {len(mm):6} {share:9.1%} {np.median(mm):9.1f} {np.quantile(mm, 0.95):8.1f} {mm.max():8.1f}"
        )
    for name, gaps in sorted(clear.items()):
        if gaps:
            print_gaps(f"objects on the floor that nothing touches, in scenes of {name!r}", np.array(gaps))
    print_gaps("objects with declared contacts", np.array(touched))


def print_gaps(what: str, gaps: np.ndarray) -> None:
    """Prints quantiles of gaps [m] in mm."""
    quantiles = ", ".join(f"{1000.0 * value:.1f}" for value in np.quantile(gaps, (0.0, 0.05, 0.5, 0.95, 1.0)))
    print(f"gap to {len(gaps)} {what}: min, 5 %, median, 95 %, max = {quantiles} mm")


if __name__ == "__main__":
    main()
