"""What clips are drawn from: what people do in them, and how the camera moves."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Literal

from storage.ranges import check_number

MAX_WEIGHT = 1e9
MAX_CAMERAS = 8
"""Of one scene."""
MAX_CLIP = 100_000
"""Time steps of one clip."""
Rig = Literal["corners", "front_top", "stereo"]
RIGS: tuple[Rig, ...] = ("corners", "front_top", "stereo")


@dataclass(frozen=True)
class ActWeights:
    """How often a person of a clip does what. The weights are non-negative numbers and not all zero.

    Attributes:
        walk: Walks from place to place, stops, looks about and gestures.
        talk: Stands, alone or facing others, and gestures.
        sit: Sits on a seat for a while: is there from the beginning and gets up, or comes and sits down.
        push: Pushes a stroller along.
    """

    walk: float = 0.5
    talk: float = 0.2
    sit: float = 0.3
    push: float = 0.08

    def __post_init__(self) -> None:
        _check("act", asdict(self))


@dataclass(frozen=True)
class CameraMoves:
    """How often the camera of a clip moves in which way. The weights are non-negative numbers and not all zero.

    Several cameras of one scene stand, but for a stereo pair.

    Attributes:
        stand: Does not move.
        pan: Turns to and fro where it stands.
        drive: Drives along a path through free floor, as on a robot.
    """

    stand: float = 0.6
    pan: float = 0.2
    drive: float = 0.2

    def __post_init__(self) -> None:
        _check("camera move", asdict(self))


def _check(what: str, weights: dict[str, float]) -> None:
    for name, weight in weights.items():
        check_number(f"{what} weight {name}", weight, 0.0, MAX_WEIGHT)
    if not sum(weights.values()) > 0.0:
        raise ValueError(f"at least one {what} weight must be positive")


def check_cameras(cameras: int, rig: str) -> None:
    """Refuses numbers of cameras that a rig does not have.

    Raises:
        ValueError: Says which numbers it has.
    """
    check_number("cameras", cameras, 1, MAX_CAMERAS)
    if rig not in RIGS:
        raise ValueError(f"rig={rig!r} is unknown; known are {', '.join(RIGS)}")
    if rig != "corners" and cameras != 2:
        raise ValueError(f"rig={rig!r} has two cameras, not cameras={cameras}; give cameras=2 or rig='corners'")


def whole_scenes(counts: Callable[[int], tuple[int, ...]], n_each: int) -> Callable[[int], tuple[int, ...]]:
    """Divides frames among the splits so that all frames of a scene or clip are in one.

    Args:
        counts: Divides scenes among the splits.
        n_each: Frames of a scene.
    """

    def counts_of(n_frames: int) -> tuple[int, ...]:
        if n_frames % n_each:
            raise ValueError(
                f"n_frames={n_frames} must be a multiple of {n_each}, the frames of one scene: cameras x clip"
            )
        return tuple(n_each * n for n in counts(n_frames // n_each))

    return counts_of
