"""What is put before recorded people: families and their weights, gaps, how much may be hidden, noise."""

from dataclasses import asdict, dataclass, field

from storage.ranges import check_number
from synth.render.sensors import SENSOR_NAMES
from synth.scene.config import MAX_WEIGHT, SceneConfig


@dataclass(frozen=True)
class ComposeWeights:
    """How often each family of objects is drawn. The weights are non-negative numbers and not all zero.

    Attributes:
        unhidden: No object: the frame as it was recorded.
        desk: A table or desk at which the person stands or sits, usually with a laptop, monitor or boxes on it.
        stroller: A stroller with its handle towards the person.
        chair: A chair with its back towards the person, or rotated at random.
        clutter: One unrelated object of any class, rotated at random.
        several: A desk, stroller or chair, and one or two further unrelated objects.
    """

    unhidden: float = 0.08
    desk: float = 0.34
    stroller: float = 0.12
    chair: float = 0.12
    clutter: float = 0.18
    several: float = 0.16

    def __post_init__(self) -> None:
        weights = asdict(self)
        for name, weight in weights.items():
            check_number(f"weight {name}", weight, 0.0, MAX_WEIGHT)
        if not sum(weights.values()) > 0.0:
            raise ValueError("at least one weight must be positive")


@dataclass(frozen=True)
class ComposeConfig:
    """Everything that composed frames depend on, except the seed and the recorded frame.

    Attributes:
        scenes: Weights of the families.
        clearance: Range of the gap between the person's points and the nearest object [m].
        visible_share: Range of the share of the person's recorded pixels that stay visible, in frames with
            objects.
        frames_per_object: Largest average number of frames that show the same object.
        sensor: Sensor model of the recording. Its noise is added to the objects before they are laid over the
            recorded depth; "ideal" adds none.
    """

    scenes: ComposeWeights = field(default_factory=ComposeWeights)
    clearance: tuple[float, float] = (0.03, 0.05)
    visible_share: tuple[float, float] = (0.15, 0.95)
    frames_per_object: int = 20
    sensor: str = "kinect_v1"

    def __post_init__(self) -> None:
        self.drawing()
        if self.clearance[0] < 0.005:
            raise ValueError(
                f"clearance={self.clearance} must be at least 0.005 m: recorded points are not a skin"
            )
        if self.sensor not in SENSOR_NAMES:
            raise ValueError(f"sensor={self.sensor!r} is unknown; known are {', '.join(SENSOR_NAMES)}")

    def drawing(self) -> SceneConfig:
        """The settings that drawing objects shares with generated scenes."""
        return SceneConfig(
            clearance=self.clearance, visible_share=self.visible_share, frames_per_object=self.frames_per_object
        )
