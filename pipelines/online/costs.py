"""What modules cost: learned from what they report, so that the planner's budget means something."""

from pipelines.online.messages import Result

MEMORY = 0.05
"""Share of what is believed that each answer renews."""
FASTEST_CHANGE = 3.0
"""An answer counts as at most so many times dearer or cheaper than believed, so that one that was held up, by a kernel
that was loaded or by another program, does not keep a module from being asked."""


class Costs:
    """Seconds of an answer of each module, as a running mean."""

    def __init__(self, first: dict[str, float]) -> None:
        """Takes what answers are believed to cost at first, by module [s]."""
        self._seconds = dict(first)

    def __getitem__(self, module: str) -> float:
        """Seconds that an answer of a module is expected to cost."""
        return self._seconds[module]

    def learn(self, result: Result) -> None:
        """Takes what an answer has cost."""
        believed = self._seconds[result.module]
        told = min(max(result.seconds, believed / FASTEST_CHANGE), believed * FASTEST_CHANGE)
        self._seconds[result.module] = believed + MEMORY * (told - believed)
