"""Draws whole scenes: several people, objects and surfaces in one image, and every person alone as a crop."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.geometry import LabelledMesh
from synth.render import layers
from synth.render.kernels import CODE_BITS, CODE_MASK, FAST
from synth.render.rasterize import Renderer
from synth.render.records import MAX_INSTANCES, RenderObject, check_body, check_mesh, check_objects
from synth.vocabulary import MAX_PEOPLE, N_PARTS

FIRST_OBJECT = N_PARTS * MAX_PEOPLE
"""Person k's part p has the code 31 (k - 1) + p; object n has this plus n: together they fill the 9 bits."""

assert FIRST_OBJECT + MAX_INSTANCES <= CODE_MASK


@dataclass(frozen=True)
class RenderPerson:
    """A person of the scene.

    Attributes:
        mesh: The posed skin in a frame of its own, faces labelled 1..31.
        T_world_mesh: (4, 4) float64.
    """

    mesh: LabelledMesh
    T_world_mesh: NDArray[np.float64]


@dataclass(frozen=True)
class BodyCrop:
    """What would be seen of one person alone.

    Attributes:
        box: (left, top, width, height) [px]; all 0 if nothing would.
        depth: (height, width) uint16 [mm], 0 = nothing.
        part: (height, width) uint8, 0 elsewhere.
    """

    box: tuple[int, int, int, int]
    depth: NDArray[np.uint16]
    part: NDArray[np.uint8]


@dataclass(frozen=True)
class RenderedRoom:
    """A whole scene as the camera sees it.

    Attributes:
        depth: (height, width) uint16 composite depth [mm], 0 = nothing.
        part: (height, width) uint8 composite body part, 0 elsewhere.
        person: (height, width) uint8 number of the person, 0 elsewhere.
        occluder: (height, width) uint8 class code, 0 elsewhere.
        instance: (height, width) uint8 object number, 0 elsewhere.
        bodies: Every person alone, in order.
        object_pixels: (largest instance + 1,) int64 pixels that each object covers alone.
    """

    depth: NDArray[np.uint16]
    part: NDArray[np.uint8]
    person: NDArray[np.uint8]
    occluder: NDArray[np.uint8]
    instance: NDArray[np.uint8]
    bodies: tuple[BodyCrop, ...]
    object_pixels: NDArray[np.int64]


class RoomRenderer(Renderer):
    """Draws whole scenes with one camera; the z-buffer, its exactness and its ties are those of `Renderer`.

    Of two people who are equally far, the one with the higher number wins.
    """

    def render_room(
        self,
        T_camera_world: NDArray[np.float64],
        people: Sequence[RenderPerson],
        objects: Sequence[RenderObject] = (),
    ) -> RenderedRoom:
        """Draws a scene.

        Args:
            T_camera_world: (4, 4).
            people: At most 8.
            objects: Objects and surfaces; those that no pixel can show may be left out.

        Returns:
            New arrays.

        Raises:
            ValueError: Too many people, a number given twice, or a mesh that cannot be drawn.
        """
        if len(people) > MAX_PEOPLE:
            raise ValueError(f"a scene of {len(people)} people; at most {MAX_PEOPLE} can be drawn")
        check_objects(objects)
        T_camera_world = np.asarray(T_camera_world, dtype=np.float64)
        width = self.camera.width
        self._composite[:] = 0
        bodies = []
        for k, one in enumerate(people):
            check_body(one.mesh)
            code = one.mesh.face_label.astype(np.int32)
            code += N_PARTS * k
            drawn = self._draw(self._alone, one.mesh, code, T_camera_world @ one.T_world_mesh)
            bodies.append(self._crop(drawn, N_PARTS * k))
            layers.merge_object(self._composite, self._alone, width, drawn, self._least)
        object_pixels = np.zeros(1 + max((item.instance for item in objects), default=0), np.int64)
        class_of_instance = np.zeros(MAX_INSTANCES + 1, np.uint8)
        for item in objects:
            check_mesh(item.mesh, f"mesh of object {item.instance}")
            code = np.full(len(item.mesh.faces), FIRST_OBJECT + item.instance, np.int32)
            drawn = self._draw(self._alone, item.mesh, code, T_camera_world @ item.T_world_mesh)
            object_pixels[item.instance] = layers.merge_object(
                self._composite, self._alone, width, drawn, self._least
            )
            class_of_instance[item.instance] = item.class_code
        self._drawn = self._whole  # `render` clears all of it
        depth, labels = self._images(class_of_instance)
        part, person, occluder, instance = labels
        return RenderedRoom(depth, part, person, occluder, instance, tuple(bodies), object_pixels)

    def _images(self, class_of_instance: NDArray[np.uint8]) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
        """Depth of the composite, and (4, height, width) its part, person, occluder and instance."""
        shape = (self.camera.height, self.camera.width)
        depth, labels = np.empty(shape, np.uint16), np.empty((4, *shape), np.uint8)
        tables = _code_tables(class_of_instance)
        packed = self._composite
        _unpack(packed, self._metres * 1000.0, self._least, *tables, depth.reshape(-1), *labels.reshape(4, -1))
        return depth, labels

    def _crop(self, drawn: NDArray[np.int64], first_code: int) -> BodyCrop:
        """What the buffer of one person alone holds, cut to its outline."""
        packed = self._box(self._alone, drawn)
        left, top, width, height = _outline(packed, self._least)
        depth, part = np.empty((height, width), np.uint16), np.empty((height, width), np.uint8)
        cut = packed[top : top + height, left : left + width]
        _unpack_crop(cut, self._metres * 1000.0, self._least, first_code, depth, part)
        if width == 0:
            return BodyCrop((0, 0, 0, 0), depth, part)
        return BodyCrop((left + int(drawn[0]), top + int(drawn[2]), width, height), depth, part)


def _code_tables(
    class_of_instance: NDArray[np.uint8],
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """(512,) part, person, class and instance by code."""
    code = np.arange(CODE_MASK + 1)
    is_person = (code > 0) & (code <= FIRST_OBJECT)
    part = np.where(is_person, (code - 1) % N_PARTS + 1, 0).astype(np.uint8)
    person = np.where(is_person, (code - 1) // N_PARTS + 1, 0).astype(np.uint8)
    instance = np.where(code > FIRST_OBJECT, code - FIRST_OBJECT, 0).astype(np.uint8)
    return part, person, class_of_instance[instance], instance


@njit(cache=True, nogil=True, error_model="numpy")
def _outline(packed: NDArray[np.int32], least: int) -> tuple[int, int, int, int]:
    """Left, top, width and height of the box round all pixels that hold something; zeros if none does."""
    height, width = packed.shape
    left, right, top, bottom = width, -1, height, -1
    for y in range(height):
        for x in range(width):
            if packed[y, x] >= least:
                left, right = min(left, x), max(right, x)
                top, bottom = min(top, y), max(bottom, y)
    if right < 0:
        return 0, 0, 0, 0
    return left, top, right - left + 1, bottom - top + 1


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _unpack_crop(
    packed: NDArray[np.int32],
    millimetres: float,
    least: int,
    first_code: int,
    depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
) -> None:
    """Splits the packed pixels of one person alone.

    Args:
        packed: (height, width) int32.
        millimetres: Depth times q [mm].
        least: Packed pixels below this are beyond the greatest depth.
        first_code: What the codes of the person's parts have more than the parts.
        depth: (height, width) uint16, receives the depth [mm].
        part: (height, width) uint8, receives the parts.
    """
    scale = np.float32(millimetres)
    for y in range(packed.shape[0]):
        for x in range(packed.shape[1]):
            value = packed[y, x] if packed[y, x] >= least else np.int32(0)
            q = np.float32(np.int32(max(value >> CODE_BITS, 1)))
            depth[y, x] = np.uint16(np.int32(scale / q + np.float32(0.5))) if value > 0 else np.uint16(0)
            part[y, x] = np.uint8((value & CODE_MASK) - first_code) if value > 0 else np.uint8(0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _unpack(
    packed: NDArray[np.int32],
    millimetres: float,
    least: int,
    part_of: NDArray[np.uint8],
    person_of: NDArray[np.uint8],
    class_of: NDArray[np.uint8],
    instance_of: NDArray[np.uint8],
    depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
    person: NDArray[np.uint8],
    occluder: NDArray[np.uint8],
    instance: NDArray[np.uint8],
) -> None:
    """Splits packed pixels into images.

    Args:
        packed: (n,) int32.
        millimetres: Depth times q [mm].
        least: Packed pixels below this are beyond the greatest depth and hold nothing.
        part_of: (512,) uint8 by code.
        person_of: (512,) uint8 by code.
        class_of: (512,) uint8 by code.
        instance_of: (512,) uint8 by code.
        depth: (n,) uint16 [mm], as the others receives the image.
        part: (n,) uint8.
        person: (n,) uint8.
        occluder: (n,) uint8.
        instance: (n,) uint8.
    """
    scale = np.float32(millimetres)
    for i in range(packed.size):
        value = packed[i] if packed[i] >= least else np.int32(0)
        q = np.float32(np.int32(max(value >> CODE_BITS, 1)))
        depth[i] = np.uint16(np.int32(scale / q + np.float32(0.5))) if value > 0 else np.uint16(0)
    for i in range(packed.size):
        code = packed[i] & CODE_MASK if packed[i] >= least else np.int32(0)
        part[i] = part_of[code]
        person[i] = person_of[code]
        occluder[i] = class_of[code]
        instance[i] = instance_of[code]
