"""Random walks: frames a second on one core; accuracy against walkers, steps, trees, limbs and the start; calibration.

python benchmarks/bench_walk.py [--model FILE] [--corpus DIR] [--split val] [--frames 200] [--seed 0]

Without a model, one is trained on the corpus; without a corpus, a small one is made first.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from forests.boxes import BOX_MARGIN_M, upper_body_box  # noqa: E402
from forests.calibration import WITHIN_M, reliability  # noqa: E402
from forests.rwf.config import UPPER_BODY, RWFConfig  # noqa: E402
from forests.rwf.model import Limbs, RWFModel  # noqa: E402
from forests.rwf.predict import Predictor  # noqa: E402
from forests.rwf.storage import load_model  # noqa: E402
from forests.rwf.tables import walk_tables  # noqa: E402
from forests.rwf.train import train  # noqa: E402
from forests.rwf.tune import View, views_of  # noqa: E402
from pipelines.commands.generate import GenerateSettings  # noqa: E402
from pipelines.corpus import Corpus  # noqa: E402
from pipelines.corpus.sequence import CorpusFrames  # noqa: E402
from synth.camera import Camera  # noqa: E402
from tests import reference_forests_rwf as reference  # noqa: E402

N_ROUNDS = 5
N_SLOW_FRAMES = 3
OFFSETS_M = (0.0, 0.1, 0.2, 0.3, 0.4)


def cpu_of(call):
    start = time.thread_time()
    call()
    return time.thread_time() - start


_OF_JOINTS = ("start_from", "scatter_m", "bandwidth_m", "n_arriving", "gate_m", "n_walks")


def upper_body(model: RWFModel) -> RWFModel:
    """The nine joints of the upper body alone."""
    keep = np.array([name in UPPER_BODY for name in model.joints])
    n = int(keep.sum())
    if not keep[:n].all():
        raise ValueError(f"the upper body's joints must come first, not {', '.join(model.joints)}")
    plan = model.plan
    cut = {name: getattr(plan, name)[:n] for name in _OF_JOINTS}
    plan = plan._replace(order=plan.order[plan.order < n], **cut)
    limbs = Limbs(model.limbs.parent[:n], model.limbs.length_m[:n])
    return replace(
        model,
        joints=model.joints[:n],
        experts=model.experts._replace(trees=model.experts.trees[:n]),
        plan=plan,
        limbs=limbs,
        weights=model.weights[:, :n],
        skeleton=None,
    )


def time_frames(model: RWFModel, images: list, boxes: list, camera: Camera) -> float:
    """CPU seconds a frame, from image and box to joints, best of some rounds over different frames."""
    walker = Predictor(model)

    def ask_all():
        for image, box in zip(images, boxes, strict=True):
            walker.predict(image, camera, box=box)

    ask_all()
    return min(cpu_of(ask_all) for _ in range(N_ROUNDS)) / len(images)


def time_twin(model: RWFModel, views: list[View]) -> float:
    """CPU seconds a frame of the slow twin."""
    tables, plan = walk_tables(model.experts), model.plan

    def ask_all():
        for view in views[:N_SLOW_FRAMES]:
            ends = {-1: view.start}
            for joint in plan.order.tolist():
                centre = ends[int(plan.start_from[joint])]
                for step in range(plan.n_steps):
                    found = reference.votes(view.depth, view.intrinsics, tables, plan, joint, 0, step, centre)
                    centre = reference.climb(found, plan.bandwidth_m[joint], found[0, :3])
                ends[joint] = centre

    return cpu_of(ask_all) / N_SLOW_FRAMES


def ask(
    model: RWFModel, views: list[View], offset_m=0.0, seed=0, is_fitted=True
) -> tuple[np.ndarray, np.ndarray, float]:
    """Errors [m] and probabilities, (n_views, n_joints), of walks from starts moved sideways; CPU seconds a frame."""
    walker = Predictor(model, is_fitted)
    walker.predict_joints(views[0].depth, views[0].camera, start=views[0].start)
    seconds = 0.0
    rng = np.random.default_rng(seed)
    error, probability = np.empty((2, len(views), len(model.joints)))
    for i, view in enumerate(views):
        angle = rng.uniform(0, 2 * np.pi)
        moved = view.start + np.float32([offset_m * np.cos(angle), offset_m * np.sin(angle), 0])
        fx, fy, cx, cy = (float(v) for v in view.intrinsics)
        camera = Camera(view.depth.shape[1], view.depth.shape[0], fx, fy, cx, cy)
        begun = time.thread_time()
        estimate = walker.predict_joints(view.depth, camera, start=moved)
        seconds += time.thread_time() - begun
        error[i] = np.linalg.norm(estimate.joints - view.joints, axis=1)
        probability[i] = estimate.probability
    return error, probability, seconds / len(views)


def score(
    model: RWFModel, views: list[View], is_occluded: np.ndarray, offset_m=0.0, seed=0, is_fitted=True
) -> str:
    """Shares of the joints within 10 cm, the mean error, and frames a second on one core."""
    error, _, seconds = ask(model, views, offset_m, seed, is_fitted)
    is_within = error <= WITHIN_M
    shares = (100 * is_within.mean(), 100 * is_within[~is_occluded].mean(), 100 * is_within[is_occluded].mean())
    upper = 100 * is_within[:, :9].mean()
    return "{:5.1f} % ({:.1f} seen, {:.1f} hidden; upper {:.1f}), mean {:.1f} cm, {:.0f} frames/s".format(
        *shares, upper, 100 * error.mean(), 1 / seconds
    )


def report_speed(model: RWFModel, frames: CorpusFrames, views: list[View]) -> None:
    shown = [frames[i] for i in range(min(len(frames), 100))]
    places = [frames.labels.joints.index(name) for name in model.config.box_joints]
    boxes = [upper_body_box(frame.joints[places], frame.camera, BOX_MARGIN_M) for frame in shown]
    images, camera = [frame.depth for frame in shown], shown[0].camera
    walker = Predictor(model)
    first = cpu_of(lambda: walker.predict(images[0], camera, box=boxes[0]))
    print(f"compile, or load from the cache {first:6.2f} s")
    for part in (upper_body(model), model):
        seconds = time_frames(part, images, boxes, camera)
        again = time_frames(part, images[:1] * 100, boxes[:1] * 100, camera)
        twin = time_twin(part, views)
        print(
            f"{len(part.joints):2d} joints: {1 / seconds:6.0f} frames/s on one core ({1e6 * seconds:.0f} us; "
            f"one frame again and again {1e6 * again:.0f} us), {twin / seconds:.0f} times as fast as the slow twin"
        )


def report_accuracy(model: RWFModel, views: list[View], is_occluded: np.ndarray, seed: int) -> None:
    print(f"within 10 cm, {len(views)} frames, {len(model.joints)} joints")
    print(f"as trained                {score(model, views, is_occluded)}")
    print(f"limbs as they come        {score(model, views, is_occluded, is_fitted=False)}")
    for offset in OFFSETS_M:
        print(f"start off by {100 * offset:3.0f} cm       {score(model, views, is_occluded, offset, seed)}")
    plan, n_trees = model.plan, len(model.experts.trees[0])
    for n_walks, n_steps in ((8, 3), (16, 3), (32, 1), (32, 2), (32, 3), (32, 5), (64, 3)):
        arriving = np.minimum(plan.n_arriving, n_steps - 1).astype(np.int32)
        counts = np.full_like(plan.n_walks, n_walks)
        changed = replace(model, plan=plan._replace(n_walks=counts, n_steps=n_steps, n_arriving=arriving))
        print(f"{n_walks:3d} walkers, {n_steps:2d} steps     {score(changed, views, is_occluded)}")
    for trees in ([tree] for tree in range(n_trees)), (range(n) for n in range(2, n_trees + 1)):
        for kept in map(list, trees):
            trees_kept = tuple(tuple(own[tree] for tree in kept) for own in model.experts.trees)
            experts = model.experts._replace(trees=trees_kept)
            changed = replace(model, experts=experts, plan=plan._replace(gate_m=plan.gate_m[:, kept]))
            print(f"trees {', '.join(map(str, kept)):20s}{score(changed, views, is_occluded)}")


def report_calibration(model: RWFModel, views: list[View], is_occluded: np.ndarray) -> None:
    """Expected error of the probability of being within 10 cm, over all joints and over some."""
    error, probability, _ = ask(model, views)
    is_within = error <= WITHIN_M
    is_upper = np.broadcast_to([name in UPPER_BODY for name in model.joints], error.shape)
    parts = {"all": np.full(error.shape, True), "upper body": is_upper, "the others": ~is_upper}
    parts |= {"seen": ~is_occluded, "hidden": is_occluded}
    for name, part in parts.items():
        found = reliability(probability[part], is_within[part])
        print(
            f"probability, {name:10s} mean {100 * probability[part].mean():5.1f} %, true of "
            f"{100 * is_within[part].mean():5.1f} %; expected calibration error {100 * found.expected_error:.1f} %"
        )
    print("  called       true of      joints")
    found = reliability(probability.ravel(), is_within.ravel())
    for called, observed, n in zip(*found, strict=True):
        print(f"  {100 * called:5.1f} %  {100 * observed:8.1f} %  {n:10d}")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--model", type=Path)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = options.corpus
        if path is None:
            path = Path(folder) / "corpus"
            GenerateSettings(out=path, frames=400).run()
        corpus = Corpus.open(path)
        numbers = corpus.split(options.split)
        frames = CorpusFrames(corpus, numbers[np.linspace(0, len(numbers) - 1, options.frames).astype(int)])
        if options.model:
            model = load_model(options.model)
        else:
            begun, cpu = time.perf_counter(), time.process_time()
            training = CorpusFrames(corpus, corpus.split("train"))
            model = train(
                training,
                RWFConfig(learn_skeleton=False),
                validation=CorpusFrames(corpus, corpus.split("val")),
                n_threads=2,
            )
            print(
                f"trained on {len(training)} frames in {time.perf_counter() - begun:.0f} s, "
                f"{time.process_time() - cpu:.0f} CPU s"
            )
        views = views_of(frames, model.joints, model.config.box_joints, BOX_MARGIN_M)
        is_occluded = np.stack([frames[i].is_occluded for i in range(len(frames))])
        if len(views) < len(frames):
            raise ValueError("some frames show nothing")
        report_speed(model, frames, views)
        report_calibration(model, views, is_occluded)
        report_accuracy(model, views, is_occluded, options.seed)


if __name__ == "__main__":
    main()
