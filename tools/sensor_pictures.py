"""Draws every sensor model beside real frames, and compares their local noise with real noise in figures.

    python tools/sensor_pictures.py OUT.png [--clean DEPTH] [--real FILE_OR_FOLDER ...] [--compare]

The clean depth is a generated scene before a wall, or any .npy or 16-bit .png of millimetres (0 = no return).
Real frames are 16-bit .png or little-endian 640x480 .raw of a Kinect v1, in millimetres.
"""

import argparse
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.ablate.config import paper_scenes
from synth.camera import Camera
from synth.render.presets import CAMERAS, camera_named
from synth.render.sensors import apply_sensor
from synth.scene import FrameSource, SceneWeights

STEPS = 8.0 * 575.816 * 75.0  # disparity steps of a Kinect v1 times depth [mm]
SENSOR_CAMERAS = {
    "ideal": "kinect_v2",
    "kinect_v1": "kinect_v1",
    "kinect_v2": "kinect_v2",
    "realsense_d435": "realsense_d435",
}

PATCHES = (5, 9, 15)
"""Sizes of the patches that noise is compared on [px]."""
BEHIND = 1.2
"""How far behind the person the wall stands [m]."""


def builtin_scene(camera: Camera, distance: float, seed: int = 0, *, is_furnished: bool) -> NDArray[np.uint16]:
    """A generated person before a wall.

    Args:
        camera: The camera.
        distance: Of the person [m].
        seed: Of the scene.
        is_furnished: Whether the person sits at a table and a floor is there; else they stand alone.

    Returns:
        (height, width) uint16 z-depth [mm].
    """
    family = "table" if is_furnished else "unhidden"
    config = replace(
        paper_scenes(),
        scenes=SceneWeights(*[float(name == family) for name in SceneWeights.names()]),
        camera="custom",
        intrinsics=(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy),
        distance=(distance, distance),
        height=(1.2, 1.2),
        azimuth=(-0.7, 0.7),
        visible_share=(0.3, 1.0),
    )
    frame = next(frame for frame in FrameSource(config, seed, 100) if is_furnished or not frame.info.objects)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.backproject(np.stack([u, v], axis=-1), np.ones(u.shape)) @ frame.T_world_camera[:3, :3].T
    ahead = frame.T_world_camera[:3, 2] * (1.0, 1.0, 0.0)
    depth = (distance + BEHIND) / (
        rays @ (ahead / np.linalg.norm(ahead))
    )  # rays have z = 1: their length is depth
    if is_furnished:
        floor = frame.T_world_camera[2, 3] / np.maximum(-rays[..., 2], 1e-9)
        depth = np.minimum(depth, floor)
    room = np.where((depth > 0) & (depth < 60.0), np.rint(1000.0 * depth), 0).astype(np.uint16)
    return np.where(frame.depth > 0, frame.depth, room)


def load_depth(path: Path) -> NDArray[np.uint16]:
    """Reads a depth image: .npy, 16-bit .png, or little-endian 640x480 .raw, in millimetres."""
    if path.suffix == ".npy":
        depth = np.load(path, allow_pickle=False)
    elif path.suffix == ".raw":
        depth = np.fromfile(path, "<u2").reshape(480, 640)
    else:
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if depth is None or depth.dtype != np.uint16 or depth.ndim != 2:
        raise SystemExit(f"{path} is no single-channel 16-bit depth image")
    return depth


def real_files(paths: list[Path], limit: int) -> list[Path]:
    """Lists depth files, evenly thinned to the limit in every folder."""
    files: list[Path] = []
    for path in paths:
        found = sorted([*path.glob("depth*.png"), *path.glob("*.raw")]) if path.is_dir() else [path]
        if not found:
            raise SystemExit(f"{path} holds no depth*.png and no *.raw")
        files += found[:: max(1, len(found) // limit)][:limit]
    return files


def local_residuals(
    depth: NDArray[np.uint16], size: int = 5, step: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fits a plane to square patches of one surface, in disparity, where planes are linear.

    Args:
        depth: (height, width) uint16 [mm], 0 = no return.
        size: Of the patches [px], odd.
        step: From patch to patch [px].

    Returns:
        (n,) mean depth [mm] and (n,) root mean square residual [disparity steps of a Kinect v1].
    """
    z = depth.astype(np.float64)
    steps = np.divide(STEPS, z, out=np.zeros_like(z), where=z > 0)
    n = size * size
    windows = np.lib.stride_tricks.sliding_window_view(steps, (size, size))[::step, ::step].reshape(-1, n)
    is_whole = (windows > 0).all(axis=1)
    windows = windows[is_whole]
    windows = windows[np.ptp(windows, axis=1) < 5.0]
    y, x = np.mgrid[:size, :size].reshape(2, n) - size // 2
    design = np.stack([np.ones(n), x, y], axis=1)
    residual = windows - windows @ (design @ np.linalg.pinv(design)).T
    return STEPS / windows.mean(axis=1), np.sqrt((residual**2).sum(axis=1) / (n - 3.0))


def pinholes(depth: NDArray[np.uint16]) -> int:
    """Holes of at most four pixels without a return."""
    return int(
        (cv2.connectedComponentsWithStats((depth == 0).astype(np.uint8), connectivity=4)[2][1:, 4] <= 4).sum()
    )


def edge_roughness(depth: NDArray[np.uint16], far: float) -> float:
    """Mean distance of the outline of what is nearer than `far` [mm] from its own smoothed outline [px]."""
    mask = ((depth > 0) & (depth < far)).astype(np.uint8)
    smooth = cv2.medianBlur(mask, 9)
    outline = np.count_nonzero(cv2.Laplacian(smooth, cv2.CV_16S) < 0)
    return float(np.count_nonzero(mask != smooth)) / max(outline, 1)


def compare(real: list[Path]) -> None:
    """Prints the local noise of real frames and of the Kinect v1 model by depth."""
    bins = np.array([700, 1000, 1500, 2000, 2500, 3000, 3500, 4000])
    rows: dict[str, list[NDArray[np.float64]]] = {"real": [], "model": [], "clean": []}
    rough: dict[str, list[float]] = {"real": [], "model": [], "clean": []}
    holes: dict[str, list[float]] = {"real": [], "model": [], "clean": []}
    wide: dict[tuple[str, int], list[NDArray[np.float64]]] = {
        (name, size): [] for name in rows for size in PATCHES
    }

    def add(name: str, depth: NDArray[np.uint16], far: float) -> None:
        rows[name].append(np.stack(local_residuals(depth)))
        rough[name].append(edge_roughness(depth, far))
        holes[name].append(pinholes(depth))
        for size in PATCHES:
            wide[name, size].append(np.stack(local_residuals(depth, size, 3)))

    for path in real:
        add("real", load_depth(path), 1e9)
    width = load_depth(real[0]).shape[1]
    camera = CAMERAS["kinect_v1"] if width == 640 else CAMERAS["kinect_v1_qvga"]
    for seed, distance in enumerate(np.linspace(1.2, 4.0, 24)):
        clean = builtin_scene(camera, distance, seed, is_furnished=False)
        far = 1000.0 * (distance + 0.7)
        for name, depth in (
            ("clean", apply_sensor("ideal", clean, camera, np.random.default_rng(seed))),
            ("model", apply_sensor("kinect_v1", clean, camera, np.random.default_rng(seed))),
        ):
            add(name, np.where(depth < far, depth, 0).astype(np.uint16), far)
    print(f"rms residual of local planes at {width} px wide, in disparity steps (number of patches)")
    print("depth [mm]      " + "".join(f"{name:>20}" for name in rows))
    for low, high in pairwise(bins):
        line = f"{low:5d} to {high:5d}  "
        for parts in rows.values():
            z, r = np.concatenate(parts, axis=1)
            is_in = (z >= low) & (z < high)
            line += f"{np.sqrt(np.mean(r[is_in] ** 2)) if is_in.any() else np.nan:12.3f} ({is_in.sum():6d})"
        print(line)
    for title, values in (("outline's distance from its smoothed self [px]", rough), ("pinholes a frame", holes)):
        print(f"{title}: {', '.join(f'{name} {np.mean(own):.3f}' for name, own in values.items())}")
    for size in PATCHES:
        told = []
        for name in rows:
            z, r = np.concatenate(wide[name, size], axis=1)
            is_in = (z >= 3000) & (z < 3750)
            told.append(f"{name} {np.median(r[is_in]) if is_in.any() else np.nan:.3f} ({is_in.sum()})")
        print(f"median residual of patches of {size} px at 3 to 3.75 m: {', '.join(told)}")


def measure_time() -> None:
    """Prints the median time of each sensor over 30 frames of 512x424, compilation apart."""
    camera = CAMERAS["kinect_v2"]
    clean = builtin_scene(camera, 2.4, is_furnished=True)
    for name in SENSOR_CAMERAS:
        spans = []
        for seed in range(31):
            rng = np.random.default_rng(seed)
            start = time.perf_counter()
            apply_sensor(name, clean, camera, rng)
            spans.append(time.perf_counter() - start)
        print(f"{name:>16} {1000 * np.median(spans[1:]):6.2f} ms a frame")


def coloured(depth: NDArray[np.uint16], near: float, far: float) -> NDArray[np.uint8]:
    """Near is red, far is blue, no return black."""
    shade = np.clip((far - depth.astype(np.float64)) / (far - near), 0.0, 1.0)
    picture = cv2.applyColorMap((255 * shade).astype(np.uint8), cv2.COLORMAP_TURBO)
    picture[depth == 0] = 0
    return picture


def tile(depth: NDArray[np.uint16], title: str, near: float, far: float, height: int = 424) -> NDArray[np.uint8]:
    """One titled picture of the sheet."""
    picture = coloured(depth, near, far)
    scale = height / picture.shape[0]
    picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    picture = cv2.copyMakeBorder(picture, 26, 4, 2, 2, cv2.BORDER_CONSTANT, value=(40, 40, 40))
    return cv2.putText(picture, title, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)


def sheet(tiles: list[NDArray[np.uint8]], n_columns: int) -> NDArray[np.uint8]:
    """Lays tiles out in rows, padded to one width."""
    rows = [np.hstack(tiles[i : i + n_columns]) for i in range(0, len(tiles), n_columns)]
    width = max(row.shape[1] for row in rows)
    return np.vstack([np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in rows])


def main() -> None:
    """Reads the command line, writes the sheet, prints the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--clean", type=Path, help="clean depth to use instead of a generated scene")
    parser.add_argument("--camera", default="kinect_v2", help="preset that the clean depth was made with")
    parser.add_argument("--real", type=Path, nargs="*", default=[], help="real frames, or folders of them")
    parser.add_argument("--compare", action="store_true", help="print local noise, real against model")
    parser.add_argument("--time", action="store_true", help="print milliseconds a frame at 512x424")
    parser.add_argument("--distance", type=float, default=2.4, help="of the generated person [m]")
    parser.add_argument("--n-real", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    tiles = []
    for name in SENSOR_CAMERAS:
        camera = CAMERAS[SENSOR_CAMERAS[name]]
        if args.clean is None:
            clean = builtin_scene(camera, args.distance, is_furnished=True)
        else:
            clean = load_depth(args.clean)
            camera = camera_named(args.camera)
        out = apply_sensor(name, clean, camera, np.random.default_rng(args.seed))
        tiles.append(tile(out, f"{name}: model", 800, 4200))
    for path in real_files(args.real, args.n_real):
        depth = load_depth(path)
        seen = depth[depth > 0]
        tiles.append(tile(depth, "real Kinect v1", float(seen.min()) - 100, float(np.percentile(seen, 99)) + 300))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(args.out), sheet(tiles, 2 if args.clean is None else len(SENSOR_CAMERAS))):
        raise SystemExit(f"could not write {args.out}")
    if args.time:
        measure_time()
    if args.compare and args.real:
        compare(real_files(args.real, 150))


if __name__ == "__main__":
    main()
