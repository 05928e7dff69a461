"""What goes wrong is told once for each cause, and counted; the counts are told at the end."""

import logging
from collections import Counter

from pipelines.online.messages import Notice

log = logging.getLogger(__name__)


class Notices:
    """Counts notices.

    Attributes:
        counts: How often each kind came.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def take(self, notice: Notice) -> None:
        """Counts a notice, and tells it if it is the first of its kind."""
        self.counts[notice.kind] += 1
        if self.counts[notice.kind] == 1:
            log.warning("warning: %s", notice.sentence)

    def summary(self) -> list[str]:
        """A sentence for each kind that came more than once, the most frequent first."""
        return [f"{kind}: {n} times in all" for kind, n in self.counts.most_common() if n > 1]
