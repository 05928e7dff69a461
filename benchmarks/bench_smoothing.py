"""Smoothing joints over time: error and jitter with and without, on people who move from one pose to another.

python benchmarks/bench_smoothing.py --model FILE --corpus DIR [--split val] [--sequences 8] [--seconds 3]

A corpus with imported objects needs their library: --objects FILE.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from forests.boxes import BOX_MARGIN_M, upper_body_box  # noqa: E402
from forests.rwf.predict import Predictor  # noqa: E402
from forests.rwf.storage import load_model  # noqa: E402
from forests.smoothing import SkeletonSmoother, SmoothingConfig  # noqa: E402
from pipelines.corpus import Corpus  # noqa: E402
from synth.bodies.body import Pose  # noqa: E402
from synth.bodies.rig.kinematics import joint_positions  # noqa: E402
from synth.bodies.rig.skinning import posed_mesh  # noqa: E402
from synth.frame import Frame  # noqa: E402
from synth.geometry import inverse, transform_points  # noqa: E402
from synth.occluders.meshlib import MeshLibrary, read_library  # noqa: E402
from synth.render import backends  # noqa: E402
from synth.render.records import RenderObject  # noqa: E402
from synth.scene.replay import occluder_of, person_of  # noqa: E402
from synth.vocabulary import OCCLUDER_CODE  # noqa: E402

FRAMES_A_SECOND = 30
NOISES_M = (0.01, 0.03, 0.1)


def sequence(
    first: Frame, last: Frame, n: int, library: MeshLibrary | None
) -> tuple[list[np.ndarray], np.ndarray]:
    """(images, (n, 15, 3) joints): the first frame's person among its objects, moving to the last's angles."""
    body, pose = person_of(first)
    T_camera_world = inverse(first.T_world_camera)
    objects = [
        RenderObject(
            occluder_of(item, library).mesh,
            OCCLUDER_CODE[item.class_name],
            item.instance,
            np.array(item.T_world_object),
        )
        for item in first.info.objects
    ]
    renderer = backends.renderer("numba", first.camera)
    images, joints = [], []
    for share in (1 - np.cos(np.linspace(0, np.pi, n))) / 2:
        angles = (1 - share) * pose.angles + share * last.angles
        moved = Pose(angles.astype(np.float64), pose.T_world_root, pose.family)
        images.append(renderer.render(T_camera_world, posed_mesh(body, moved), objects).depth)
        joints.append(transform_points(T_camera_world, joint_positions(body.skeleton, moved)))
    return images, np.array(joints)


def pairs_of(corpus: Corpus, split: str, n: int) -> list[tuple[int, int]]:
    """Frames of one pose family each, one behind the other in the split."""
    numbers = corpus.split(split).tolist()
    families = {number: corpus.info(number).pose_family for number in numbers}
    found = []
    for place, number in enumerate(numbers):
        others = [other for other in numbers[place + 1 :] if families[other] == families[number]]
        if others:
            found.append((number, others[0]))
    return [found[k * len(found) // n] for k in range(n)]


def summary(name: str, joints: np.ndarray, truth: np.ndarray) -> str:
    error = np.linalg.norm(joints - truth, axis=-1)
    steps = np.diff(joints, axis=1) - np.diff(truth, axis=1)
    jitter = np.linalg.norm(steps, axis=-1).mean()
    share = 100 * (error <= 0.1).mean()
    jitter_mm, error_cm = 1000 * jitter, 100 * error.mean()
    return f"{name:18} error {error_cm:5.1f} cm, within 10 cm {share:4.1f} %, jitter {jitter_mm:5.1f} mm/frame"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--split", default="val")
    parser.add_argument("--sequences", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--objects", type=Path)
    options = parser.parse_args()
    library = read_library(options.objects) if options.objects else None
    walker, corpus = Predictor(load_model(options.model)), Corpus.open(options.corpus)
    places = [walker.model.labels.joints.index(name) for name in walker.model.joints]
    inside = [walker.model.labels.joints.index(name) for name in walker.model.config.box_joints]
    n = round(options.seconds * FRAMES_A_SECOND)
    found, trust, truths = [], [], []
    for first, last in pairs_of(corpus, options.split, options.sequences):
        frame = corpus[first]
        images, joints = sequence(frame, corpus[last], n, library)
        boxes = [upper_body_box(true[inside], frame.camera, BOX_MARGIN_M) for true in joints]
        answers = [walker.predict(image, frame.camera, box=box) for image, box in zip(images, boxes, strict=True)]
        found.append([answer.joints for answer in answers])
        trust.append([answer.confidence for answer in answers])
        truths.append(joints[:, places])
    estimates, truth = np.array(found), np.array(truths)
    print(f"{len(estimates)} sequences of {n} frames, {FRAMES_A_SECOND} frames/s")
    print(summary("as they come", estimates, truth))
    for noise_m in NOISES_M:
        smooth = np.empty_like(estimates)
        for k, (path, sure) in enumerate(zip(estimates, trust, strict=True)):
            smoother = SkeletonSmoother(SmoothingConfig(noise_m=noise_m))
            smooth[k] = [smoother.update(j, c, 1 / FRAMES_A_SECOND) for j, c in zip(path, sure, strict=True)]
        print(summary(f"noise_m={noise_m}", smooth, truth))


if __name__ == "__main__":
    main()
