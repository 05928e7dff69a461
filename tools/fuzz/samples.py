"""Small samples of all formats, made by the program itself, by the tests' toys and by the usual libraries."""

import contextlib
import functools
import io
import json
import os
from pathlib import Path

import cv2
import numpy as np

SETTINGS = {
    "generate": (
        "frames = 12\nseed = 3\nworkers = 1\nrenderer = \"numba\"\nposes_splits = [\"train\", \"val\"]\n"
        "[scene]\ncamera = \"custom\"\nintrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]\ndistance = [1.0, 3.0]\n"
        "child_share = 0.1\nis_context_kept = true\n[scene.scenes]\ntable = 0.5\nstroller = 0.25\n"
    ),
    "train": (
        "max_frames = 40\nthreads = 1\noverwrite = false\n[forest]\njoints = [\"head\", \"neck\"]\nn_points = 30\n"
        "reach_m = 0.3\nbox_joints = [\"neck\"]\n[forest.growth]\nmax_depth = 5\nmax_offset_m = 0.5\n"
    ),
    "ablate": (
        "rows = [\"baseline\", \"semantic\"]\nn_seeds = { oarf = 2 }\nn_resamples = 50\ntree_counts = [1, 2]\n"
        "[corpus]\ntrain_frames = 10\nval_frames = 3\ntest_frames = 6\nseed = 3\n[corpus.scene]\ncamera = \"custom\"\n"
        "intrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]\n[oarf]\nn_trees = 2\ngrowth = { max_depth = 6 }\n"
    ),
}  # fmt: skip
"""TOML files of settings."""
INDEX = "file,class,unit,up,forward,split\nwhole.obj,other,m,z,x,train\nbox.obj,other,m,z,,val\n"
LAYOUT = """
recognised_by = []
files = "*.{suffix}"
format = "{format}"
width = 64
height = 48
camera = {{ fx = 60.0, fy = 60.0, cx = 31.5, cy = 23.5 }}
"""
ANNOTATION = """
[annotation]
files = "{}_labels.h5"
y_up = true
names = %s
joints = %s
"""
N_FRAMES = 40


def run(*words: object) -> None:
    """Runs a command of the program, quietly."""
    from pipelines.cli import main

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
        code = main([str(word) for word in words])
    assert code == 0, said.getvalue()


def corpus(folder: Path) -> Path:
    """A corpus of toy frames."""
    from pipelines.corpus import Order, write_corpus
    from tests.pipelines.toy_source import ToySource

    make = functools.partial(ToySource, 3, N_FRAMES)
    write_corpus(folder / "corpus", Order(3, N_FRAMES, {"toy": True}, make))
    return folder / "corpus"


def model(folder: Path, kind: str) -> Path:
    """A model of a kind, trained on toy frames."""
    out = folder / f"{kind}.safetensors"
    own = {
        "oarf": ["--n-trees", 2, "--n-pixels", 40, "--n-occluder-pixels", 40, "--n-voting-pixels", 50],
        "rwf": ["--n-trees", 1, "--n-points", 20, "--joints", "neck", "head"],
    }[kind]
    growth = ["--growth.max-depth", 4, "--growth.n-candidates", 20, "--growth.n-finalists", 5]
    run("train", kind, corpus(folder), "--out", out, "--max-frames", 20, *own, *growth)
    return out


def ablation_settings() -> str:
    """Settings of a tiny ablation."""
    few = "n_pixels = 60\nn_occluder_pixels = 60\nn_voting_pixels = 50\n"
    return SETTINGS["ablate"].replace("growth = {", few + "growth = {")


def ablation(folder: Path) -> Path:
    """The folder of a tiny ablation."""
    (folder / "ablate.toml").write_text(ablation_settings())
    run(
        "ablate",
        "--size",
        "demo",
        "--config",
        folder / "ablate.toml",
        "--out",
        folder / "ablation",
        "--threads",
        1,
    )
    return folder / "ablation"


def toy_layout(folder: Path) -> str:
    """The layout of `tests.pipelines.toy_recording`."""
    from tests.pipelines.toy_recording import write_layout

    return write_layout(folder)


def depth(folder: Path, suffix: str) -> Path:
    """A depth image of somebody in a file, and a layout beside."""
    from tests.pipelines.toy_recording import NAMES, silhouette, standing

    image = silhouette(standing())
    kind = {"h5": "itop"}.get(suffix, suffix.rsplit(".", maxsplit=1)[-1])
    text = LAYOUT.format(suffix=suffix.rsplit(".", maxsplit=1)[-1], format=kind)
    if kind == "itop":
        joints = "{ " + ", ".join(f'{name} = "{name}"' for name in NAMES) + " }"
        text += ANNOTATION % (json.dumps(NAMES), joints)
    (folder / "layout.toml").write_text(text)
    path = folder / f"image.{suffix}"
    if kind == "png":
        path.write_bytes(cv2.imencode(".png", image)[1].tobytes())
    elif kind in ("pgm", "tiff"):
        path.write_bytes(cv2.imencode(f".{kind}", image)[1].tobytes())
    elif kind == "exr":
        _write_exr(path, image)
    elif kind == "npy":
        np.save(path, image)
    elif kind == "raw":
        image.astype("<u2").tofile(path)
    elif kind == "itop":
        _write_itop(path, image)
    else:
        _write_cloud(path, image, suffix.split(".", maxsplit=1)[0])
    return path


def _write_exr(path: Path, image: np.ndarray) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"Z": np.ascontiguousarray(image / np.float32(1000.0), np.float32)}) as file:
        file.write(str(path))


def _write_itop(path: Path, image: np.ndarray) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.create_dataset("data", data=(np.stack([image] * 3) / 1000.0).astype(np.float16), compression="gzip")
        file["id"] = np.array([b"00_00001", b"00_00002", b"01_00003"])


def _write_cloud(path: Path, image: np.ndarray, way: str) -> None:
    z = np.where(image > 0, image / 1000.0, np.nan).astype("<f4").ravel()
    header = (
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH 64\nHEIGHT 48\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {image.size}\n"
    )
    if way == "ascii":
        body = ("DATA ascii\n" + "\n".join(f"0 0 {value:.3f}" for value in z) + "\n").encode()
    elif way == "binary":
        points = np.zeros((image.size, 3), "<f4")
        points[:, 2] = z
        body = b"DATA binary\n" + points.tobytes()
    else:
        plain = np.concatenate([np.zeros(2 * image.size, "<f4"), z]).tobytes()
        runs = [bytes([len(part) - 1]) + part for part in (plain[k : k + 32] for k in range(0, len(plain), 32))]
        packed = b"".join(runs)  # literals alone are LZF too
        body = (
            b"DATA binary_compressed\n"
            + len(packed).to_bytes(4, "little")
            + len(plain).to_bytes(4, "little")
            + packed
        )
    path.write_bytes(header.encode() + body)


def recordings(folder: Path) -> Path:
    """Two BVH files of people who stand and sit; gives the second."""
    from tests.mocap_files import SIT, STAND, bvh_text, standing_root

    folder.mkdir()
    text = bvh_text([(angles, standing_root(angles)) for angles in (STAND, SIT)])
    (folder / "01_whole.bvh").write_text(text)
    (folder / "02_01.bvh").write_text(text)
    return folder / "02_01.bvh"


def mesh(folder: Path, suffix: str) -> Path:
    """Two boxes, one as OBJ, the other as asked for; gives the second."""
    import trimesh

    folder.mkdir()
    box = trimesh.creation.box((0.4, 0.3, 0.5))
    (folder / "whole.obj").write_bytes(_exported(box, "obj"))
    path = folder / f"box{suffix}"
    if suffix == ".urdf":
        parts = folder / "parts"
        parts.mkdir()
        (parts / "top.stl").write_bytes(_exported(box, "stl"))
        path.write_text(URDF)
    elif suffix == ".gltf":
        for name, data in box.export(file_type="gltf").items():
            (path if name.endswith(".gltf") else folder / name).write_bytes(data)
    else:
        path.write_bytes(_exported(box, suffix[1:]))
    return path


def _exported(box, kind: str) -> bytes:  # type: ignore[no-untyped-def] # of trimesh, which has no types
    data = box.export(file_type=kind)
    return data.encode() if isinstance(data, str) else data


URDF = """<?xml version="1.0"?>
<robot name="table">
  <link name="base">
    <visual><geometry><mesh filename="parts/top.stl" scale="1 1 1"/></geometry></visual>
  </link>
  <link name="drawer">
    <visual><origin xyz="0 0 0.5"/><geometry><box size="0.4 0.3 0.1"/></geometry></visual>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="base"/><child link="drawer"/><axis xyz="1 0 0"/><limit lower="0" upper="0.3" effort="1" velocity="1"/>
  </joint>
</robot>
"""


def quiet() -> None:
    """Sets what a process needs before it loads anything: no threads of BLAS, no bars of progress."""
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, "1")
