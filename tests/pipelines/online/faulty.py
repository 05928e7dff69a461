"""Modules that answer, raise, hang or cannot be opened, as tests tell them to by their model's name."""

import time

import numpy as np

from pipelines.online.messages import OrientationResult


class Obedient:
    """Answers with the sum of the image as angle; the model names a stamp and what to do then."""

    def __init__(self, settings):
        if settings.model == "unopenable":
            raise ValueError("the model is broken")
        what, _, stamp = settings.model.partition("@")
        self.what, self.stamp = what, int(stamp or -1)

    def analyse(self, depth, job):
        if job.stamp == self.stamp and self.what == "raise":
            raise RuntimeError("told to")
        if job.stamp == self.stamp and self.what == "hang":
            time.sleep(60)
        if self.what == "slow":
            time.sleep(0.15)
        total = float(depth.astype(np.int64).sum())
        return [
            OrientationResult(r.stamp, job.frame_id, r.track_id, r.module, 0.001, "body", total, 1.0, 0.5, "", 0.5)
            for r in job.requests
        ]
