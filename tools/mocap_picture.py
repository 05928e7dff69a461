"""Draws recorded poses as stick figures beside our bodies in the same poses, with the seats of those who sit.

    python tools/mocap_picture.py FOLDER LIBRARY OUT.jpg [--only TRIAL ...] [--n 24] [--seed 1]

FOLDER holds the BVH files that LIBRARY was made from. Each pair shows the recording on the left, a sampled
body on the right, both from a bearing of their own; grey is depth, objects are blue.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.retarget import heading_of
from synth.bodies.mocap.source import Source, read_source
from synth.bodies.mocap.text import decode_bvh
from synth.bodies.poses.library import PoseLibrary, read_library
from synth.bodies.poses.place import place_pose
from synth.bodies.poses.sit import seat_contact, seat_height_of
from synth.bodies.rig.skinning import posed_mesh
from synth.bodies.shape.make import make_body
from synth.bodies.spec import sample_body
from synth.camera import Camera
from synth.geometry import LabelledMesh, inverse, look_at, transform_points, translation
from synth.occluders import registry
from synth.occluders.furniture.chair import sample_stool
from synth.render import backends
from synth.render.records import RenderObject
from synth.scene.pools import dressed_to_sit
from synth.vocabulary import OCCLUDER_CODE

CAMERA = Camera(210, 300, 330.0, 330.0, 104.5, 149.5)
BONES = (
    ("head", "neck"), ("neck", "l_shoulder"), ("neck", "r_shoulder"), ("l_shoulder", "l_elbow"),
    ("l_elbow", "l_wrist"), ("r_shoulder", "r_elbow"), ("r_elbow", "r_wrist"), ("neck", "hips"),
    ("l_hip", "r_hip"), ("l_hip", "l_knee"), ("l_knee", "l_ankle"), ("l_ankle", "l_toe"), ("r_hip", "r_knee"),
    ("r_knee", "r_ankle"), ("r_ankle", "r_toe"),
)  # fmt: skip


def camera_at(azimuth: float, height: float) -> NDArray[np.float64]:
    """T_world_camera of a camera that looks at a person on the origin."""
    eye = np.array([2.9 * np.cos(azimuth), 2.9 * np.sin(azimuth), height + 0.35])
    return look_at(eye, (0.0, 0.0, height))


def with_straight_rest(source: Source, frame: int) -> NDArray[np.float64]:
    """(n_roles, 3) joints of a frame, each limb as it is retargeted: turned since the T-pose, if there is one."""
    old, points = source.position[frame], source.position[frame].copy()
    for k, side in enumerate("lr"):
        for limb, (start, end) in enumerate(
            (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
        ):
            a, b = source.joints[f"{side}_{start}"], source.joints[f"{side}_{end}"]
            points[b] = points[a] + np.linalg.norm(old[b] - old[a]) * source.limb[frame, k, limb]
        ankle, toe = source.joints[f"{side}_ankle"], source.joints[f"{side}_toe"]
        points[toe] = points[ankle] + old[toe] - old[ankle]
    return points


def stick_figure(source: Source, frame: int, T_world_camera: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(height, width, 3) the recording, turned to face x; the left side is red, the right one green."""
    heading = float(heading_of(source.pelvis[frame : frame + 1])[0])
    c, s = np.cos(-heading), np.sin(-heading)
    points = with_straight_rest(source, frame) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    root = points[source.joints["hips"]]
    points = points - (root[0], root[1], source.position[:, :, 2].min())
    uv = CAMERA.project(transform_points(inverse(T_world_camera), points))
    image = np.full((CAMERA.height, CAMERA.width, 3), 25, np.uint8)
    for a, b in BONES:
        colour = {"l": (80, 80, 255), "r": (80, 220, 80)}.get(b[0] if b[1] == "_" else "", (220, 220, 220))
        ends = [tuple(int(v) for v in np.rint(uv[source.joints[name]])) for name in (a, b)]
        cv2.line(image, ends[0], ends[1], colour, 2, cv2.LINE_AA)
    head = tuple(int(v) for v in np.rint(uv[source.joints["head"]]))
    cv2.circle(image, head, 8, (220, 220, 220), 1, cv2.LINE_AA)
    return image


def body_picture(
    skin: LabelledMesh, objects: list[RenderObject], T_world_camera: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """(height, width, 3) shaded by the slope of the depth; left arm and leg reddish, right ones greenish."""
    pair = backends.renderer("numba", CAMERA).render(inverse(T_world_camera), skin, objects)
    depth = cv2.GaussianBlur(pair.depth.astype(np.float32), (3, 3), 0.0)
    dx, dy = cv2.Sobel(depth, cv2.CV_32F, 1, 0) / 8.0, cv2.Sobel(depth, cv2.CV_32F, 0, 1) / 8.0
    shade = 1.0 / np.sqrt(1.0 + (dx / 10.0) ** 2 + (dy / 10.0) ** 2)
    grey = (60.0 + 195.0 * shade)[..., None] * np.ones(3)
    grey[pair.occluder > 0] *= (1.0, 0.7, 0.55)
    grey[pair.depth == 0] = 25.0
    return grey.astype(np.uint8)


def seat_under(body: Body, pose: Pose, height: float) -> RenderObject:
    """A stool at the height that the pose was made for."""
    stool = registry.make(replace(sample_stool(np.random.default_rng(0)), seat_height=round(height, 4)))
    x, y, _ = seat_contact(body, pose)
    return RenderObject(stool.mesh, OCCLUDER_CODE["chair"], 1, translation(x, y, 0.0))


def pair_of(library: PoseLibrary, row: int, source: Source, frame: int, seed: int) -> NDArray[np.uint8] | None:
    """Recording and body of one pose, the source's given frame; None if it does not fit the body drawn."""
    rng = np.random.default_rng([seed, row])
    body = make_body(dressed_to_sit(sample_body(rng, 0.15)))
    height = min(max(seat_height_of(body), 0.36), 0.6) if library.is_sitting[row] else None
    pose = place_pose(library, row, body, rng, height)
    if pose is None:
        return None
    objects = [] if height is None else [seat_under(body, pose, height)]
    trial = library.trials[int(library.trial[row])]
    azimuth = float(rng.uniform(-1.2, 1.2))
    T = camera_at(azimuth, 0.85)
    left = stick_figure(source, frame, T)
    image = np.hstack([left, body_picture(posed_mesh(body, pose), objects, T)])
    label = f"{trial.name} {int(library.frame[row])}"
    cv2.putText(image, label, (4, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (255, 255, 255), 1, cv2.LINE_AA)
    return image


def main() -> None:
    """Writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("library", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--sitting", action="store_true")
    parser.add_argument("--n", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    library = read_library(args.library)
    names = np.array([trial.name for trial in library.trials])[library.trial]
    is_wanted = np.isin(names, args.only) if args.only else np.ones(len(library), np.bool_)
    if args.sitting:
        is_wanted &= library.is_sitting
    rng = np.random.default_rng(args.seed)
    rows = np.sort(rng.permutation(np.flatnonzero(is_wanted))[: args.n])
    files = {path.name: path for path in args.folder.rglob("*.bvh")}
    needed = {library.trials[int(library.trial[row])].file for row in rows}
    recordings = {name: parse_bvh(decode_bvh(files[name].read_bytes())) for name in needed}
    sources = {name: read_source(bvh) for name, bvh in recordings.items()}
    pairs = []
    for row in rows:
        file = library.trials[int(library.trial[row])].file
        frame = int(np.searchsorted(recordings[file].frame, library.frame[row]))
        pairs.append(pair_of(library, int(row), sources[file], frame, args.seed))
    pairs = [image for image in pairs if image is not None]
    print(f"{len(pairs)} of {len(rows)} poses fit the bodies drawn")
    pairs += [np.full_like(pairs[0], 25)] * (-len(pairs) % 4)
    cv2.imwrite(str(args.out), np.vstack([np.hstack(pairs[k : k + 4]) for k in range(0, len(pairs), 4)]))


if __name__ == "__main__":
    main()
