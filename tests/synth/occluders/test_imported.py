"""Meshes of others become occluders: upright, in metres, turned to their user, filled by boxes, stored whole."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from storage.digested import read_digested, write_digested
from synth.geometry import surface_points
from synth.occluders.imported.boxes import fill_with_boxes, solids_of
from synth.occluders.imported.levels import find_level
from synth.occluders.imported.model import make_model
from synth.occluders.imported.shape import MeshError, Triangles, cleaned, is_closed, reduced, sampled
from synth.occluders.imported.sizes import TO_UPRIGHT, Hints, Said
from synth.occluders.meshlib import FORMAT, MeshLibrary, MeshLibraryError, MeshModel, read_library, write_library
from synth.occluders.solids.distance import solid_distances
from synth.scene import FrameSource, ObjectMix, SceneConfig, SceneWeights
from synth.scene.replay import occluder_of

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
CUBE = np.array([
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip


def boxes(*parts: Box) -> Triangles:
    """A mesh of closed boxes, each (lower corner, upper corner), z up."""
    corners = np.array([[c & 4 > 0, c & 2 > 0, c & 1 > 0] for c in range(8)], dtype=np.float64)
    vertices = [np.array(low) + corners * (np.array(high) - np.array(low)) for low, high in parts]
    faces = [CUBE + 8 * k for k in range(len(parts))]
    return Triangles(np.concatenate(vertices), np.concatenate(faces))


def table(long: float = 1.4, deep: float = 0.8, high: float = 0.74) -> Triangles:
    """A table on four legs, its long side along x, on a floor somewhere."""
    legs = [
        ((x, y, 1.0), (x + 0.05, y + 0.05, 1.0 + high - 0.03))
        for x in (0.0, long - 0.05)
        for y in (0.0, deep - 0.05)
    ]
    return boxes(((0.0, 0.0, 1.0 + high - 0.03), (long, deep, 1.0 + high)), *legs)


def chair() -> Triangles:
    """A block with a back at +y: its sitter looks along -y."""
    return boxes(((0, 0, 0), (0.45, 0.45, 0.45)), ((0, 0.41, 0.45), (0.45, 0.45, 0.9)))


def laptop() -> Triangles:
    """A deck with an upright screen at -x: its user looks along -x."""
    return boxes(((0, 0, 0), (0.24, 0.34, 0.02)), ((0, 0, 0.02), (0.008, 0.34, 0.23)))


def model(mesh: Triangles, class_name: str, split: str = "train", name: str = "one", **hints: str) -> MeshModel:
    return make_model(mesh, name, class_name, split, Hints(**hints), Said("z"))[0]


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cm", 100.0), ("mm", 1000.0), ("inch", 1 / 0.0254)])
@pytest.mark.parametrize("up", ["y", "z"])
def test_a_table_is_found_in_any_unit_with_either_axis_up(unit: str, scale: float, up: str) -> None:
    made = model(table().turned(TO_UPRIGHT[up].T, scale), "table")
    assert made.frame == f"{unit}, {up} up"
    assert made.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    top = made.occluder.anchor("top")
    assert top.T_object_anchor[2, 3] == pytest.approx(0.74, abs=1e-5)
    assert top.size == pytest.approx((0.8, 1.4), abs=0.021)  # its width lies along y
    assert np.abs(top.T_object_anchor[:2, 3]).max() < 1e-9
    assert made.role == "table"
    assert made.is_closed


def test_sizes_without_sense_are_refused() -> None:
    with pytest.raises(
        MeshError, match=r"is 40 x 0.8 x 0.74, which in any of m, cm, mm, inch is no table \(0.25-"
    ):
        model(table(long=40.0), "table")
    with pytest.raises(MeshError, match="which in m is no laptop"):
        model(laptop().turned(np.eye(3), 9.0), "laptop", unit="m")


def test_knees_do_not_go_through_a_chest() -> None:
    chest = boxes(((0, 0, 0), (1.4, 0.8, 0.74)))
    assert model(chest, "table").role == "obstacle"


def test_a_closed_front_is_turned_away_from_who_sits_at_a_desk() -> None:
    front = boxes(((0, 0.78, 0.1), (1.4, 0.8, 0.71)))
    desk = table().shifted(0, 0, -1.0)
    both = Triangles(
        np.concatenate([desk.vertices, front.vertices]), np.r_[desk.faces, front.faces + len(desk.vertices)]
    )
    made = model(both, "table")
    assert made.role == "table"
    board = made.vertices[-8:]
    assert board[:, 0].min() > 0.3  # at +x, away from the user at -x


def test_a_sitter_looks_away_from_the_back() -> None:
    made = model(chair(), "chair")
    above = made.vertices[made.vertices[:, 2] > 0.6]
    assert above[:, 0].max() < 0.0
    seat = made.occluder.anchor("seat")
    assert seat.T_object_anchor[2, 3] == pytest.approx(0.45, abs=1e-6)
    assert seat.size == pytest.approx((0.41, 0.45), abs=0.021)
    turned = model(chair(), "chair", forward="y")
    assert turned.vertices[turned.vertices[:, 2] > 0.6][:, 0].min() > 0.0


def test_a_laptop_has_its_screen_ahead_and_keys_on_its_deck() -> None:
    made = model(laptop(), "laptop")
    assert made.vertices[made.vertices[:, 2] > 0.1][:, 0].min() > 0.1
    assert made.occluder.anchor("base").size == pytest.approx((0.24, 0.34), abs=1e-6)
    left, right = (made.occluder.anchor(f"keyboard_{side}").T_object_anchor[:3, 3] for side in ("left", "right"))
    assert left[1] > 0.0 > right[1]
    assert left[2] == pytest.approx(0.02, abs=1e-6)
    assert abs(left[0]) < 0.1
    with pytest.raises(MeshError, match="is no laptop"):
        model(boxes(((0, 0, 0), (0.24, 0.34, 0.02))), "laptop")  # shut


def test_boxes_hold_the_surface_to_half_a_voxel_and_stick_out_by_no_more_than_one() -> None:
    voxel = 0.008
    mesh = cleaned(table())
    solids = solids_of(fill_with_boxes(mesh))
    points = sampled(mesh, 0.02)
    assert solid_distances(solids, np.eye(4), points).max() < 0.5 * voxel
    rng = np.random.default_rng(0)
    around = rng.uniform((-0.2, -0.2, 0.8), (1.6, 1.0, 1.9), (4000, 3))
    true = np.min([_distance_to(b, around) for b in _parts(mesh)], axis=0)
    found = solid_distances(solids, np.eye(4), around)
    is_outside = true > 0.0
    short = (true - found)[is_outside]
    assert short.min() > -0.5 * voxel
    assert short.max() < voxel * np.sqrt(3.0)
    ball = cleaned(_ball(0.3))
    distance = solid_distances(solids_of(fill_with_boxes(ball)), np.eye(4), sampled(ball, 0.01))
    assert distance.max() < 0.002
    far = rng.normal(size=(2000, 3))
    far *= 0.4 / np.linalg.norm(far, axis=1)[:, None]
    gap = 0.1 - solid_distances(solids_of(fill_with_boxes(ball)), np.eye(4), far)
    assert gap.min() > -0.002
    assert gap.max() < 0.03 * np.sqrt(3.0)


def _parts(mesh: Triangles) -> list[np.ndarray]:
    return [np.r_[v.min(axis=0), v.max(axis=0)] for v in table().vertices.reshape(-1, 8, 3)]


def _distance_to(box: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.maximum(np.maximum(box[:3] - points, points - box[3:]), 0.0), axis=1)


def _ball(radius: float, n: int = 60) -> Triangles:
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n), indexing="ij")
    xyz = radius * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(2 * n - 1), indexing="ij")
    a = i * 2 * n + j
    quads = [np.stack([a, a + 2 * n, a + 2 * n + 1], -1), np.stack([a, a + 2 * n + 1, a + 1], -1)]
    return Triangles(xyz.reshape(-1, 3), np.concatenate(quads).reshape(-1, 3))


def test_cleaning_welds_and_drops_what_is_no_triangle() -> None:
    cube = boxes(((0, 0, 0), (1, 1, 1)))
    loose = Triangles(cube.vertices[cube.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    dirty = Triangles(loose.vertices, np.r_[loose.faces, [(0, 0, 1)], loose.faces[:1]])
    clean = cleaned(dirty)
    assert (len(clean.vertices), len(clean.faces)) == (8, 12)
    assert is_closed(clean)
    assert not is_closed(Triangles(clean.vertices, clean.faces[1:]))
    assert not is_closed(Triangles(clean.vertices, clean.faces[:, ::-1]))
    with pytest.raises(MeshError, match="is flat"):
        cleaned(Triangles(cube.vertices * (1, 1, 0), cube.faces))
    with pytest.raises(MeshError, match="not finite"):
        cleaned(Triangles(cube.vertices * (1, 1, np.nan), cube.faces))
    with pytest.raises(MeshError, match=r"outside 0\.\.7"):
        cleaned(Triangles(cube.vertices, cube.faces + 1))
    with pytest.raises(MeshError, match="no triangles"):
        cleaned(Triangles(cube.vertices, cube.faces[:0]))


def test_heavy_meshes_are_reduced_and_stay_where_they_were() -> None:
    ball = cleaned(_ball(0.3))
    light = reduced(ball, 3000)
    assert 500 < len(light.faces) <= 3000 < len(ball.faces)
    assert np.abs(np.linalg.norm(light.vertices, axis=1) - 0.3).max() < 0.01


def test_a_round_top_is_an_ellipse() -> None:
    rho, phi = np.meshgrid(np.arange(0.0, 0.5, 0.004), np.linspace(0, 2 * np.pi, 900))
    points = np.stack([rho * np.cos(phi), rho * np.sin(phi), np.full_like(rho, 0.7)], -1).reshape(-1, 3)
    level = find_level(points, (0.3, 1.2), 0.01)
    assert level is not None
    assert level.shape == "ellipse"
    assert level.size == pytest.approx((1.0, 1.0), abs=0.03)
    assert find_level(points, (0.8, 1.2), 0.01) is None


def test_unknown_hints_and_classes_list_the_known_ones() -> None:
    with pytest.raises(MeshError, match="unit='ell' is unknown, known are m, cm, mm, inch"):
        Hints(unit="ell")
    with pytest.raises(MeshError, match="unknown class 'lamp', known are table, laptop"):
        model(table(), "lamp")
    with pytest.raises(MeshError, match="is along its up axis"):
        model(table(), "table", up="z", forward="z")


@pytest.fixture(scope="module")
def library() -> MeshLibrary:
    made = (("t", table(), "table"), ("c", chair(), "chair"), ("l", laptop(), "laptop"))
    return MeshLibrary(tuple(model(mesh, name, "test", label) for label, mesh, name in made), {"seed": 0})


def test_a_library_comes_back_as_it_was_or_says_that_it_is_damaged(library: MeshLibrary, tmp_path: Path) -> None:
    path = tmp_path / "lib"
    write_library(path, library)
    again = read_library(path)
    assert again.digest == library.digest
    assert again.model("c").occluder.anchor("seat").size == library.model("c").occluder.anchor("seat").size
    write_library(tmp_path / "second", again)
    assert path.read_bytes() == (tmp_path / "second").read_bytes()
    data = bytearray(path.read_bytes())
    data[-9] ^= 1
    path.write_bytes(data)
    with pytest.raises(MeshLibraryError, match="damaged"):
        read_library(path)
    with pytest.raises(MeshLibraryError, match="there is no object library"):
        read_library(tmp_path / "none")
    with pytest.raises(MeshLibraryError, match="'t' is there twice"):
        replace(library, models=(*library.models, library.models[0]))


ANCHOR = {"name": "top", "T_object_anchor": np.eye(4).tolist(), "size": [1.0, 1.0], "shape": "rectangle"}


@pytest.mark.parametrize(
    "change",
    [
        {"models": None}, {"models": [None]}, {"models": [[]]}, {"models": {"a": 1}},
        {"models": [{"anchors": []}]}, {"settings": None}, {"settings": [1]},
        *({"anchors": value} for value in (None, 7, [None], [[]], [{}], [ANCHOR | {"name": None}])),
        *({"anchors": [ANCHOR | {"T_object_anchor": value}]} for value in (None, [1.0], [[None] * 4] * 4, {})),
        *({"anchors": [ANCHOR | {"size": value}]} for value in (None, 1.0, [1.0], ["a", "b"], [[1.0], 2.0])),
        {"anchors": [ANCHOR | {"shape": ["oval"]}]}, {"name": None}, {"split": ["test"]}, {"is_closed": "yes"},
        {"other": 1},
    ],
)  # fmt: skip
def test_metadata_of_another_shape_is_one_clear_error(library: MeshLibrary, tmp_path: Path, change: dict) -> None:
    path = tmp_path / "lib"
    write_library(path, library)
    kind, arrays, metadata = read_digested(path, FORMAT)
    if not change.keys() <= metadata.keys():
        change = {"models": [metadata["models"][0] | change, *metadata["models"][1:]]}
    write_digested(path, FORMAT, kind, arrays, metadata | change)
    with pytest.raises(MeshLibraryError) as caught:
        read_library(path)
    assert str(path) in str(caught.value)


def test_scenes_take_models_in_the_splits_that_use_them(library: MeshLibrary) -> None:
    weights = SceneWeights(*[float(name == "laptop_table") for name in SceneWeights.names()])
    config = SceneConfig(camera="custom", intrinsics=(160, 120, 142.0, 142.0, 79.5, 59.5), scenes=weights)
    mixed = FrameSource(config, 3, 5, objects=ObjectMix(library, 1.0, ("test",)))
    assert mixed.counts == (4, 0, 1)
    frame, same = mixed.frame(4), FrameSource(config, 3, 5, objects=ObjectMix(library, 1.0, ("test",))).frame(4)
    for item in frame.info.objects:
        model = library.model(item.spec_id.rpartition("/")[2])
        assert occluder_of(item, library).mesh is model.occluder.mesh
    with pytest.raises(ValueError, match="is imported: the object library that it came from is needed"):
        occluder_of(frame.info.objects[0])
    with pytest.raises(ValueError, match="is not of this library: the library has no model"):
        occluder_of(frame.info.objects[0], MeshLibrary((), {}))
    assert {item.spec_id for item in frame.info.objects} == {
        "imported/table/test/t", "imported/chair/test/c", "imported/laptop/test/l",
    }  # fmt: skip
    assert np.array_equal(frame.depth, same.depth)
    assert frame.info == same.info
    record = frame.info.objects[0]
    assert library.model(record.spec["name"]).spec_id == record.spec_id
    placed = {item.class_name: np.array(item.T_world_object) for item in frame.info.objects}
    assert placed["laptop"][2, 3] == pytest.approx(0.74, abs=1e-5)  # on the top, not over it
    plain = FrameSource(config, 3, 5)
    assert np.array_equal(plain.frame(0).depth, mixed.frame(0).depth)
    with pytest.raises(ValueError, match="no models for split 'train'"):
        ObjectMix(library)
    with pytest.raises(ValueError, match=r"share=2\.0"):
        ObjectMix(library, 2.0, ("test",))


def test_objects_surface_is_within_its_solids(library: MeshLibrary) -> None:
    for item in library.models:
        points = surface_points(item.occluder.mesh, 0.05)
        assert solid_distances(item.occluder.solids, np.eye(4), points).max() < 1e-6
