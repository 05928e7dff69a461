"""What a corpus's scenes are drawn from: families and their weights, cameras, distances, variety."""

from dataclasses import asdict, dataclass, field, fields

from storage.ranges import check_fields, check_number, check_span
from synth.bodies.spec import WARDROBES, Wardrobe
from synth.camera import Camera
from synth.render.presets import camera_named, mounting_named
from synth.scene.clips.config import MAX_CLIP, ActWeights, CameraMoves, Rig, check_cameras
from synth.scene.room.config import PeopleConfig, RoomConfig, check_rooms

DRAWS_PER_BLOCK = 60
"""Consecutive frames of a split that share a pool of subjects and objects."""

MAX_WEIGHT = 1e9
"""Of a scene family or a split."""


@dataclass(frozen=True)
class SceneWeights:
    """How often each scene family is drawn. The weights are non-negative numbers and not all zero.

    Attributes:
        unhidden: A person alone, or with a seat and nothing else.
        table: A person who sits or stands at a table.
        laptop_table: A person who types on a laptop that stands on a table.
        laptop_lap: A person who types on a laptop on their lap.
        stroller: A person who pushes a stroller.
        clutter: An unrelated object between the camera and the person.
        several: A scene with a table or a stroller, and further unrelated objects.
    """

    unhidden: float = 0.36
    table: float = 0.14
    laptop_table: float = 0.11
    laptop_lap: float = 0.05
    stroller: float = 0.08
    clutter: float = 0.18
    several: float = 0.08

    def __post_init__(self) -> None:
        weights = asdict(self)
        for name, weight in weights.items():
            check_number(f"scene weight {name}", weight, 0.0, MAX_WEIGHT)
        if not sum(weights.values()) > 0.0:
            raise ValueError("at least one scene weight must be positive")

    @staticmethod
    def names() -> tuple[str, ...]:
        """The scene families, in the order of their weights."""
        return tuple(f.name for f in fields(SceneWeights))


@dataclass(frozen=True)
class SplitShares:
    """The share of the frames in each split. The shares are non-negative numbers and not all zero."""

    train: float = 0.70
    val: float = 0.10
    test: float = 0.20

    def __post_init__(self) -> None:
        shares = asdict(self)
        for name, share in shares.items():
            check_number(f"split share {name}", share, 0.0, MAX_WEIGHT)
        if not sum(shares.values()) > 0.0:
            raise ValueError(f"split shares {shares} must not be all zero")

    def counts(self, n_frames: int) -> tuple[int, ...]:
        """Frames of each split by the largest remainder, in the order of `SPLITS`."""
        shares = [self.train, self.val, self.test]
        exact = [share * n_frames / sum(shares) for share in shares]
        counts = [int(value) for value in exact]
        by_remainder = sorted(range(3), key=lambda k: (counts[k] - exact[k], k))
        for k in by_remainder[: n_frames - sum(counts)]:
            counts[k] += 1
        return tuple(counts)


@dataclass(frozen=True)
class SceneConfig:
    """Everything that the scenes of a corpus depend on, except the seed.

    Attributes:
        scenes: Weights of the scene families.
        splits: Shares of train, val and test. No subject, object or drawn pose occurs in two of them.
        camera: Name of a camera preset, or "custom" to use `intrinsics`.
        intrinsics: Image size and pinhole parameters (width, height, fx, fy, cx, cy) of the custom camera [px].
        mounting: Name of a mounting preset, which gives ranges of the camera's height, pitch and distance.
        distance: Range of the horizontal distance from camera to person [m]. It replaces the range of the
            mounting.
        height: Range of the camera's height above the floor [m]. It replaces the range of the mounting.
        azimuth: Range of the direction of the camera as seen from the person [rad]; 0 is in front of the person,
            positive angles are on their left.
        frontal_share: Share of the views whose direction is drawn near the front, normally distributed by 45
            degrees within `azimuth`. The others are drawn evenly.
        near_share: Share of the views in which the person stands 0.6 to 1.5 m before the camera, so that the image
            shows the upper body and cuts the rest off. It leaves out distances that `distance` does not hold.
        clearance: Range of the gap between the surfaces of person and object, except at declared contacts [m].
        visible_share: Range of the share of the person's pixels that stay visible, in scenes with objects.
        seated_share: Share of seated people among those without objects or behind unrelated objects.
        standing_at_table_share: Share of standing people in scenes of the family table.
        exercising_share: Share of exercising people among those who stand without objects or behind unrelated
            ones. They move the arms anywhere, squat, lunge and raise legs.
        life_share: Share of people who take a pose of recorded life or of the wide families (stooping, squatting,
            arms anywhere) among those whose hands touch nothing and who do not exercise.
        unlike_legs: How much the legs of people who sit at tables and with laptops differ from each other: 0 near
            copies, 1 as people sit at ease.
        wardrobe: What people wear. "everyday" has straight and wide trousers, long coats and pullovers with slack
            at the elbows; "plain" has neither.
        is_context_kept: Whether object class and pose are related as in everyday life. If not, they are drawn
            independently of each other with the same frequencies.
        frames_per_subject: Largest average number of frames that show the same subject.
        frames_per_object: Largest average number of frames that show the same object of a class.
        child_share: Share of subjects under 18 years.
        stature: Range from which the statures of some adults are drawn evenly [m]; the body mass index stays that
            of the population.
        stature_share: Share of the adults whose stature is drawn from that range. Those of the others follow the
            population, in which very tall people are rare.
        room: The rooms around the people. By default there are none, and every frame shows one person cut out.
        people: How many people are in a room, and in which groups.
        cameras: How many cameras see each scene at the same time; every image is a frame of the corpus.
        rig: How several cameras are put up: "corners" around the people, "front_top" (two: one as drawn, one that
            looks straight down), or "stereo" (two, side by side).
        clip: Time steps of a clip; 0 draws single moments. Clips need rooms.
        fps: Time steps a second.
        acts: What people do in clips; the groups of `people` and the weights of `scenes` are for single moments.
        camera_moves: How the camera moves in clips.
    """

    scenes: SceneWeights = field(default_factory=SceneWeights)
    splits: SplitShares = field(default_factory=SplitShares)
    camera: str = "kinect_v2"
    intrinsics: tuple[int, int, float, float, float, float] | None = None
    mounting: str = "any"
    distance: tuple[float, float] | None = None
    height: tuple[float, float] | None = None
    azimuth: tuple[float, float] = (-3.141592653589793, 3.141592653589793)
    frontal_share: float = 0.5
    near_share: float = 0.2
    clearance: tuple[float, float] = (0.03, 0.05)
    visible_share: tuple[float, float] = (0.15, 0.95)
    seated_share: float = 0.35
    standing_at_table_share: float = 0.12
    exercising_share: float = 0.15
    life_share: float = 0.6
    unlike_legs: float = 0.6
    wardrobe: Wardrobe = "everyday"
    is_context_kept: bool = True
    frames_per_subject: int = 20
    frames_per_object: int = 20
    child_share: float = 0.15
    stature: tuple[float, float] = (1.5, 2.0)
    stature_share: float = 0.5
    room: RoomConfig = field(default_factory=RoomConfig)
    people: PeopleConfig = field(default_factory=PeopleConfig)
    cameras: int = 1
    rig: Rig = "corners"
    clip: int = 0
    fps: float = 30.0
    acts: ActWeights = field(default_factory=ActWeights)
    camera_moves: CameraMoves = field(default_factory=CameraMoves)

    def __post_init__(self) -> None:
        self.make_camera()
        mounting_named(self.mounting)
        for name, low, high in (
            ("distance", 0.4, 20.0),
            ("height", 0.0, 10.0),
            ("stature", 1.3, 2.15),
            ("azimuth", -6.3, 6.3),
            ("clearance", 0.0, 1.0),
            ("visible_share", 0.0, 1.0),
        ):
            check_span(name, getattr(self, name), low, high)
        check_fields(self, dict.fromkeys(("frames_per_subject", "frames_per_object"), (1, DRAWS_PER_BLOCK)))
        check_fields(self, dict.fromkeys(_SHARES, (0.0, 1.0)))
        if self.wardrobe not in WARDROBES:
            raise ValueError(f"wardrobe={self.wardrobe!r} is unknown; known are {', '.join(WARDROBES)}")
        check_rooms(self.room, self.people, self.distance)
        check_cameras(self.cameras, self.rig)
        check_fields(self, {"clip": (0, MAX_CLIP), "fps": (1.0, 240.0)})
        if self.clip and not self.room.is_on:
            raise ValueError(
                f"clip={self.clip} needs a room to walk in; give room kinds too, such as room.kinds.hall=1"
            )

    def told(self) -> dict[str, object]:
        """The settings as values by name; what is not in use (rooms, several cameras, clips) is not told."""
        values = asdict(self)
        if self.cameras == 1:
            del values["cameras"], values["rig"]
        if not self.clip:
            del values["clip"], values["fps"], values["acts"], values["camera_moves"]
        if not self.room.is_on:
            del values["room"], values["people"]
        return values

    @property
    def frames_a_scene(self) -> int:
        """Frames that show one scene: every camera at every time step."""
        return self.cameras * max(self.clip, 1)

    def make_camera(self) -> Camera:
        """The camera that all frames are seen through."""
        if self.camera != "custom":
            if self.intrinsics is not None:
                raise ValueError(f"intrinsics are for camera='custom', not camera={self.camera!r}")
            return camera_named(self.camera)
        if self.intrinsics is None:
            raise ValueError("camera='custom' needs intrinsics (width, height, fx, fy, cx, cy)")
        width, height, fx, fy, cx, cy = self.intrinsics
        return Camera(int(width), int(height), fx, fy, cx, cy)


_SHARES = (
    "seated_share", "standing_at_table_share", "exercising_share", "life_share", "unlike_legs", "child_share",
    "frontal_share", "near_share", "stature_share",
)  # fmt: skip
