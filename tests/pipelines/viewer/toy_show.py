"""Two people in a bare room, told as the on-line system would: one walks, one has joints that are hidden."""

import numpy as np

from forests.frames import Intrinsics
from pipelines.online.messages import NS, Plan, Request, Skip, TrackedPerson, TrackSkeleton
from pipelines.viewer.moments import Arrow, Labels, Moment

CAMERA = Intrinsics(100.0, 100.0, 63.5, 47.5)
T_FLOOR_CAMERA = np.array([[0, 0, 1.0, 0], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1]])
"""At (0, 0, 1.2) m, looking along x."""
JOINTS = ("head", "neck", "torso", "r_hip", "l_hip")
WALL_M = 4.0
COLOURS = np.array([(0, 0, 0), (0, 200, 0)], np.uint8)


def skeleton(track_id, x, y, hidden):
    places = np.array([(x, y, 1.6), (x, y, 1.4), (x, y, 1.1), (x, y - 0.15, 0.9), (x, y + 0.15, 0.9)], np.float32)
    sure = np.ones(5, np.float32)
    return TrackSkeleton(
        NS, "floor", track_id, "walks", JOINTS, places, sure, 0 * sure, np.full(5, hidden, np.float32)
    )


def person(track_id, x, y, speed):
    return TrackedPerson(track_id, np.array([x, y]), np.array([0.0, speed]), np.eye(4), 1.75, 0.9, 1.0, 0.0, None)


class ToyShow:
    """Person 1 walks to the left, 0.2 m from moment to moment; person 3 stands, with hidden joints."""

    fps = 10.0

    def __init__(self, n=5):
        self.n = n

    def __len__(self):
        return self.n

    def close(self):
        self.is_closed = True

    def moment(self, number):
        y = -0.6 + 0.2 * number
        depth = np.full((96, 128), int(1000 * WALL_M), np.uint16)
        codes = np.zeros((96, 128), np.uint8)
        codes[:, :40] = 1
        asked = Request(NS, 1, "walks", (0, 0, 1, 1), (0, 0, 1, 1), np.zeros(3))
        skip = Skip(NS, 3, "walks", "too far away for the module")
        return Moment(
            f"the toy at {number}",
            depth,
            CAMERA,
            T_FLOOR_CAMERA,
            {"left side": Labels(codes, COLOURS)},
            (person(1, 2.0, y, 1.0), person(3, 2.5, 0.9, 0.0)),
            (skeleton(1, 2.0, y, 0.0), skeleton(3, 2.5, 0.9, 1.0)),
            (Arrow(1, "body", np.array([0.0, 1.0])),),
            Plan(NS, (asked,), (skip,), 0.002, 0.02),
        )
