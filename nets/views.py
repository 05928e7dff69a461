"""What nets look at."""

from typing import NamedTuple


class View(NamedTuple):
    """The piece of the world that a net looks at.

    Attributes:
        height: Rows of the net's input.
        width: Columns of the net's input.
        margin: Rows and columns more on each side of a patch, from which inputs are cropped.
        pixel_m: Side of a pixel at the person's distance [m].
        reach_m: Depths are told within so much of the person's distance [m].
    """

    height: int
    width: int
    margin: int
    pixel_m: float
    reach_m: float

    @property
    def patch(self) -> tuple[int, int]:
        """(height, width) with the margin."""
        return self.height + 2 * self.margin, self.width + 2 * self.margin
