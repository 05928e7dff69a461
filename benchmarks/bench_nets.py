"""Speed of nets: patches cut, images learned from, and persons asked about, a second on one core.

Usage: python benchmarks/bench_nets.py

Where torch sees a GPU, training is measured there as well.
"""

import time
from collections.abc import Callable

import numpy as np
import onnxruntime
import torch

from forests.frames import Intrinsics
from nets.heatmap.config import HeatmapConfig
from nets.heatmap.export import to_onnx as heatmap_to_onnx
from nets.heatmap.model import N_TERMS, OUTCOMES, HeatmapModel
from nets.heatmap.network import HeatmapNet, Names
from nets.heatmap.predict import ask_net
from nets.inputs import crop_inputs, draw, training_inputs
from nets.modules import to_arrays
from nets.orientation.config import VIEWS, OrientationConfig
from nets.orientation.export import to_onnx
from nets.orientation.frames import patch_of
from nets.orientation.model import OrientationModel
from nets.orientation.network import OrientationNet
from nets.orientation.predict import n_crops_of

N = 64


def per_second(work: Callable[[], object], n: int) -> float:
    """Best of five: things done a second of CPU time."""
    work()
    best = np.inf
    for _ in range(5):
        begun = time.thread_time()
        work()
        best = min(best, time.thread_time() - begun)
    return n / best


def learn(net: torch.nn.Module, images: torch.Tensor) -> None:
    """One step forward and backward."""
    angle, concentration, auxiliary = net(images)
    (angle.sum() + concentration.sum() + auxiliary.sum()).backward()


def on_gpu(config: OrientationConfig, images: torch.Tensor) -> float:
    """Images learned from a second on the GPU."""
    net, images = OrientationNet(config).cuda().train(), images.cuda().repeat(16, 1, 1, 1)
    for _ in range(3):
        learn(net, images)
    torch.cuda.synchronize()
    begun = time.perf_counter()
    for _ in range(20):
        learn(net, images)
    torch.cuda.synchronize()
    return 20 * len(images) / (time.perf_counter() - begun)


def session_of(graph: bytes) -> onnxruntime.InferenceSession:
    """A graph, ready to be run in one thread."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])


def heat_maps(rng: np.random.Generator) -> None:
    """Prints the figures of the heat map net of default size."""
    config = HeatmapConfig()
    net, n_joints = HeatmapNet(config, Names(15)), 15
    images = torch.randn((16, 2, config.view.height, config.view.width))
    net.train()
    learned = per_second(lambda: sum(value.sum() for value in net(images)).backward(), len(images))  # type: ignore[union-attr]
    names = tuple(map(str, range(n_joints)))
    model = HeatmapModel(config, names, to_arrays(net), np.zeros((len(OUTCOMES), n_joints, N_TERMS), np.float32))
    net.eval()
    relative = rng.integers(-300, 300, config.view.patch).astype(np.int16)
    asked = per_second(lambda: ask_net(net, model, relative), 1)
    session, batch = session_of(heatmap_to_onnx(model)), images[:1].numpy()
    run = per_second(lambda: session.run(None, {"images": batch}), 1)
    n_weights = sum(value.numel() for value in net.parameters())
    print(
        f"heat maps, {n_weights} weights: {learned:.0f} learned/s, {asked:.0f} persons/s by torch, {run:.0f} by ONNX"
    )


def main() -> None:
    torch.set_num_threads(1)
    rng = np.random.default_rng(0)
    heat_maps(rng)
    depth = rng.integers(2000, 2300, (424, 512)).astype(np.uint16)
    camera, box = Intrinsics(365.0, 365.0, 255.5, 211.5), (200.0, 60.0, 320.0, 400.0)
    print(
        f"{'':<14}{'patches/s':>12}{'inputs/s':>12}{'learned/s':>12}{'torch/s':>12}{'ONNX/s':>12}{'one by one':>12}"
    )
    for region, architecture in VIEWS:
        config = OrientationConfig(region=region, architecture=architecture)
        view, n_crops = config.view, n_crops_of(config)
        cut = per_second(lambda r=region, w=view: patch_of(r, w, depth, camera, box), 1)  # type: ignore[misc]
        relative = rng.integers(-300, 300, (N, *view.patch)).astype(np.int16)
        kind = torch.ones((N, *view.patch), dtype=torch.uint8)
        draws, generator = draw(rng, N, config), torch.Generator()
        given = torch.from_numpy(relative)
        made = per_second(
            lambda g=given, k=kind, d=draws, w=view, r=generator: training_inputs(g, k, d, w, r),  # type: ignore[misc]
            N,
        )
        images = crop_inputs(relative, view, 1)
        net = OrientationNet(config).train()
        learned = per_second(lambda n=net, i=images: learn(n, i), N)  # type: ignore[misc]
        net.eval()
        with torch.inference_mode():
            asked = per_second(lambda n=net, i=images: n(i), N) / n_crops  # type: ignore[misc]
        graph = to_onnx(OrientationModel(config, to_arrays(net)))
        session = session_of(graph)
        batch = images.numpy()
        many = per_second(lambda s=session, b=batch: s.run(None, {"images": b}), N) / n_crops  # type: ignore[misc]
        one = per_second(lambda s=session, b=batch[:1]: s.run(None, {"images": b}), 1) / n_crops  # type: ignore[misc]
        print(
            f"{region} {architecture:<8}" + "".join(f"{f:>12.0f}" for f in (cut, made, learned, asked, many, one))
        )
        if torch.cuda.is_available():
            print(f"{'':<14}{on_gpu(config, images):.0f} learned/s on {torch.cuda.get_device_name()}")


if __name__ == "__main__":
    main()
