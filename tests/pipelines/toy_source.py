"""A toy frame source: a ball of a person behind a box, every field filled, made from (seed, index) alone."""

import time

import numpy as np

from synth.camera import Camera
from synth.frame import Frame, FrameInfo, ObjectRecord
from synth.geometry import look_at
from synth.vocabulary import N_JOINTS, N_PARTS, OCCLUDER_CODE

WIDTH, HEIGHT, N_DOF = 64, 48, 7


class ToySource:
    """Frames of a few pixels; `pause` seconds each, so that a test can interrupt."""

    def __init__(self, seed=0, n_frames=200, pause=0.0, width=WIDTH, height=HEIGHT):
        self.seed, self.n_frames, self.pause = seed, n_frames, pause
        self.width, self.height = width, height

    def split_of(self, index):
        share = index / self.n_frames
        return "train" if share < 0.7 else "val" if share < 0.85 else "test"

    def frame(self, index):
        time.sleep(self.pause)
        rng = np.random.default_rng([self.seed, index])
        split = self.split_of(index)
        scale = self.width / 64
        camera = Camera(
            self.width, self.height, 60.0 * scale, 60.0 * scale, (self.width - 1) / 2, 23.5 * scale, "toy"
        )
        v, u = np.mgrid[: self.height, : self.width] / scale
        centre = rng.uniform((20, 16), (44, 32))
        radius = np.hypot(u - centre[0], v - centre[1])
        ball = radius < 14
        body_depth = np.where(ball, 2000 + 300 * (radius / 14) ** 2, 0).astype(np.uint16)
        body_part = np.where(ball, 1 + (u // 4 + 7 * (v // 12)) % N_PARTS, 0).astype(np.uint8)
        has_object = index % 4 != 0
        box = has_object & (u > 24) & (u < 50) & (v > rng.integers(20, 40))
        depth = np.where(box, 1500 + 10 * (index % 7), body_depth).astype(np.uint16)
        part = np.where(box, 0, body_part).astype(np.uint8)
        code = OCCLUDER_CODE["table"]
        T_world_camera = look_at((-2.0, rng.uniform(-1, 1), 1.0), (0.0, 0.0, 1.0))
        centres = np.stack([rng.uniform(8, 56, N_JOINTS), rng.uniform(4, 44, N_JOINTS)], axis=1) * scale
        joints = camera.backproject(centres, np.full(N_JOINTS, 2.1)).astype(np.float32)
        visible = (part > 0).sum() / max(1, ball.sum())
        counts, all_counts = (np.bincount(x.ravel(), minlength=32) for x in (part, body_part))
        share = np.where(all_counts > 0, counts / np.maximum(1, all_counts), 0)
        share[0] = 0
        subject = f"subject/{split}/{index // 20:04d}"
        objects = ()
        if has_object:
            spec = {"kind": "table", "height": 0.7 + 0.01 * (index // 20), "legs": 4}
            pose = tuple(tuple(row) for row in np.eye(4).tolist())
            objects = (ObjectRecord(1, "table", f"table/{split}/{index // 20:04d}", spec, pose, 0.9),)
        info = FrameInfo(
            self.seed, index, split, subject, {"stature": 1.7, "sex": "f"}, "table" if has_object else "free",
            ("standing", "sitting", "writing")[index % 3], f"pose/{split}/{index:06d}", float(visible), objects,
        )  # fmt: skip
        return Frame(
            depth=depth,
            part=part,
            occluder=np.where(box, code, 0).astype(np.uint8),
            instance=box.astype(np.uint8),
            body_depth=body_depth,
            body_part=body_part,
            joints=joints,
            joint_state=rng.integers(0, 4, N_JOINTS).astype(np.uint8),
            joint_visible_fraction=rng.random(N_JOINTS, dtype=np.float32),
            part_visible_fraction=share.astype(np.float32),
            angles=rng.normal(size=N_DOF).astype(np.float32),
            T_world_root=np.eye(4),
            T_world_camera=T_world_camera,
            camera=camera,
            info=info,
        )
