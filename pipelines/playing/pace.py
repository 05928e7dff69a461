"""Images at the speed at which they were taken: those that come too late are left out, as of a camera."""

import time
from collections.abc import Callable, Iterable, Iterator

from pipelines.online.messages import NS, CameraFrame, Notice

LATE_S = 0.1
"""An image that would be begun with so much later than it was taken is left out [s]."""
LONGEST_WAIT_S = 1.0
"""Longer gaps, as between two clips, are not waited for [s]."""


def paced(
    items: Iterable[CameraFrame | Notice],
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Iterator[CameraFrame | Notice]:
    """Gives images when their time has come; the first at once."""
    begin: float | None = None
    last = 0
    for item in items:
        if isinstance(item, Notice):
            yield item
            continue
        if begin is None or not 0 <= (item.stamp - last) / NS <= LONGEST_WAIT_S:
            begin = clock() - item.stamp / NS
        last = item.stamp
        wait = begin + item.stamp / NS - clock()
        if wait > 0:
            sleep(wait)
        if wait < -LATE_S:
            yield Notice("images that came too late", f"an image is left out: it came {-wait:.2f} s too late")
        else:
            yield item
