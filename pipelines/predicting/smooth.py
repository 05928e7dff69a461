"""Skeletons of a sequence, smoothed: a filter a track, for forests of either kind."""

from collections import defaultdict
from dataclasses import replace

from forests.estimate import JointEstimate
from forests.smoothing import PersonSmoother


class TrackSmoother:
    """Smooths the people of a sequence, each apart.

    Attributes:
        fps: Frames a second.
    """

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self._smoothers: defaultdict[str, PersonSmoother] = defaultdict(PersonSmoother)
        self._ticks: dict[str, int] = {}

    def smoothed(self, track: str, tick: int, estimate: JointEstimate) -> JointEstimate:
        """The estimate with its joints, the first proposals, smoothed; a joint not found goes on for a while.

        The confidence of a regression forest is no share, so that probabilities weigh the estimates.

        Args:
            track: Whose it is.
            tick: Its place in time, in frames; where it is not later than the track's last, the track begins anew.
            estimate: As the forest answered.
        """
        seconds = (tick - self._ticks.get(track, tick)) / self.fps
        self._ticks[track] = tick
        proposals = estimate.proposals.copy()
        proposals[:, 0] = self._smoothers[track].update(estimate.joints, estimate.probability, seconds)
        return replace(estimate, proposals=proposals)
