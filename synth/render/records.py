"""What every renderer takes and gives: objects of a scene, the pair of layers, and their checks."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import LabelledMesh
from synth.vocabulary import N_PARTS, SCENE_CLASSES

NEAR = 0.25
"""Default near plane [m]: nothing closer is drawn."""
DEPTH_MAX_MM = 65535
"""Greatest depth that uint16 millimetres hold; what lies beyond counts as nothing."""
MAX_INSTANCES = 255
"""Object numbers are stored in uint8, 0 is none."""


@dataclass(frozen=True)
class RenderObject:
    """An object of the scene.

    Attributes:
        mesh: Its surface in its own frame; the face labels are not used.
        class_code: Code of its class in `SCENE_CLASSES`.
        instance: Its number in the frame, 1..255, unique.
        T_world_mesh: (4, 4) float64.
    """

    mesh: LabelledMesh
    class_code: int
    instance: int
    T_world_mesh: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        if not 1 <= self.instance <= MAX_INSTANCES:
            raise ValueError(
                f"instance={self.instance} must be in 1..{MAX_INSTANCES}: "
                f"a frame holds at most {MAX_INSTANCES} objects"
            )
        if not 1 <= self.class_code < len(SCENE_CLASSES):
            raise ValueError(
                f"class_code={self.class_code} must be in 1..{len(SCENE_CLASSES) - 1}, "
                f"the codes of {', '.join(SCENE_CLASSES[1:])}"
            )


@dataclass(frozen=True)
class RenderedPair:
    """Two layers of one scene: what the camera sees, and the person without the objects.

    Attributes:
        depth: (height, width) uint16 composite depth along the optical axis [mm], 0 = nothing.
        part: (height, width) uint8 composite body part 1..31, 0 elsewhere.
        occluder: (height, width) uint8 composite class code, 0 elsewhere.
        instance: (height, width) uint8 composite object number, 0 elsewhere.
        body_depth: (height, width) uint16 depth of the person alone [mm].
        body_part: (height, width) uint8 parts of the person alone.
        object_pixels: (largest instance + 1,) int64 pixels that each object covers when it is drawn alone,
            by instance; 0 for numbers that the frame does not use.
    """

    depth: NDArray[np.uint16]
    part: NDArray[np.uint8]
    occluder: NDArray[np.uint8]
    instance: NDArray[np.uint8]
    body_depth: NDArray[np.uint16]
    body_part: NDArray[np.uint8]
    object_pixels: NDArray[np.int64]


class Backend(Protocol):
    """A renderer of one camera.

    Attributes:
        camera: Its intrinsics.
        near: Near plane [m].
        description: Which back end and device draws, in words.
    """

    camera: Camera
    near: float
    description: str

    def render(
        self,
        T_camera_world: NDArray[np.float64],
        body: LabelledMesh | None,
        objects: Sequence[RenderObject] = (),
    ) -> RenderedPair:
        """Draws both layers of a scene.

        Args:
            T_camera_world: (4, 4).
            body: The person, world frame, faces labelled 1..31; None for a scene without one.
            objects: The objects.
        """
        ...


def check_objects(objects: Sequence[RenderObject]) -> None:
    """Refuses objects that share a number.

    Raises:
        ValueError: Names the number.
    """
    seen: set[int] = set()
    for item in objects:
        if item.instance in seen:
            raise ValueError(f"instance={item.instance} is given twice, each object needs a number of its own")
        seen.add(item.instance)


def check_mesh(mesh: LabelledMesh, name: str) -> None:
    """Refuses a mesh that the kernels cannot draw safely.

    Args:
        mesh: The mesh.
        name: What the error calls it.

    Raises:
        ValueError: A face names a vertex that does not exist, or a coordinate is not finite.
    """
    if len(mesh.faces):
        low, high = int(mesh.faces.min()), int(mesh.faces.max())
        if low < 0 or high >= len(mesh.vertices):
            raise ValueError(
                f"{name} has faces with vertex indices {low}..{high}, must be in 0..{len(mesh.vertices) - 1}"
            )
    if not np.isfinite(mesh.vertices).all():
        raise ValueError(f"{name} has a vertex coordinate that is not finite")


def check_body(body: LabelledMesh) -> None:
    """Refuses a body that cannot be drawn, or whose faces are not labelled 1..31.

    Raises:
        ValueError: Says which.
    """
    check_mesh(body, "body mesh")
    if len(body.face_label) and not (body.face_label.min() >= 1 and body.face_label.max() <= N_PARTS):
        raise ValueError(
            f"body mesh has face labels {body.face_label.min()}..{body.face_label.max()}, must be in 1..{N_PARTS}"
        )


def check_near(near: float) -> None:
    """Refuses a near plane that is not in 0.01..10 m.

    Raises:
        ValueError: Says so.
    """
    if not 0.01 <= near <= 10.0:
        raise ValueError(f"near={near} must be in 0.01..10 m")
