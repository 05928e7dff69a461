"""Laws of the z-buffer: shared sides, ties, order, clipping, degenerate input, errors."""

import numpy as np
import pytest
import trimesh

from synth.camera import Camera
from synth.geometry import LabelledMesh, axis_angle, translation
from synth.render.backends import renderer
from synth.render.rasterize import Renderer
from synth.render.records import RenderedPair, RenderObject
from tests.reference_render import rasterize_slow
from tests.render_scenes import NEAR, labelled, random_scene

SMALL = Camera(48, 40, 50.0, 48.0, 23.3, 20.1)
MIDDLE = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
EYE = np.eye(4)


def draw(camera: Camera, body: LabelledMesh | None, *objects: RenderObject) -> RenderedPair:
    return Renderer(camera, NEAR).render(EYE, body, objects)


def as_open(vertices: np.ndarray, faces: np.ndarray, label: int | np.ndarray = 1) -> LabelledMesh:
    return labelled(trimesh.Trimesh(vertices, faces, process=False), label, is_closed=False)


def quad(x: tuple[float, float], y: tuple[float, float], z: float, label: int = 1) -> LabelledMesh:
    corners = np.array([(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)])
    return as_open(corners, np.array([(0, 1, 2), (0, 2, 3)]), label)


def assert_pairs_equal(a: RenderedPair, b: RenderedPair) -> None:
    for name in RenderedPair.__dataclass_fields__:
        assert np.array_equal(getattr(a, name), getattr(b, name)), name


@pytest.mark.parametrize("seed", range(8))
def test_triangles_are_drawn_as_the_slow_twin_draws_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 30
    centre = rng.uniform((-0.6, -0.5, 1.0), (0.6, 0.5, 3.0), (n, 1, 3))
    corners = centre + rng.normal(size=(n, 3, 3)) * rng.choice([0.02, 0.1, 0.4], (n, 1, 1)) * (1, 1, 0.5)
    corners[..., 2] = np.maximum(corners[..., 2], 0.4)
    mesh = as_open(corners.reshape(-1, 3), np.arange(3 * n).reshape(n, 3), rng.integers(1, 32, n))
    depth, label, _ = rasterize_slow(SMALL, mesh)
    drawn = Renderer(SMALL, NEAR)
    pair = drawn.render(EYE, mesh)
    assert np.array_equal(pair.body_part, label)
    assert np.abs(drawn.depth_metres()[1] - depth).max() < 5e-5
    assert np.abs(pair.depth * 1e-3 - depth).max() < 5.5e-4


def test_each_pixel_of_a_tessellated_rectangle_belongs_to_one_triangle() -> None:
    rng = np.random.default_rng(3)
    s, t = np.meshgrid(np.arange(11.0), np.arange(11.0))
    is_inner = (s > 0) & (s < 10) & (t > 0) & (t < 10)
    # corners on pixel centres and between them: ties on every kind of side
    s += is_inner * rng.choice([-0.25, 0.0, 0.1, 0.25], s.shape)
    t += is_inner * rng.choice([-0.25, 0.0, 0.1, 0.25], t.shape)
    camera = Camera(64, 64, 32.0, 32.0, 32.0, 32.0)
    vertices = np.column_stack([(s.ravel() - 5) / 8, (t.ravel() - 5) / 8, np.ones(s.size)])
    corner = np.arange(121).reshape(11, 11)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    whole = draw(camera, as_open(vertices, faces))
    inside = (np.abs(np.arange(64) - 32) <= 20) & (np.arange(64) < 52)  # left and top sides are in, right ones out
    assert np.array_equal(whole.part > 0, inside[:, None] & inside[None, :])
    singles = [RenderObject(as_open(vertices, face[None]), 1, i + 1) for i, face in enumerate(faces)]
    pairs = draw(camera, None, *singles)
    assert pairs.object_pixels.sum() == 40 * 40
    assert np.array_equal(np.bincount(pairs.instance.ravel(), minlength=201)[1:], pairs.object_pixels[1:])


def test_slivers_thinner_than_a_subpixel_leave_no_holes() -> None:
    rng = np.random.default_rng(4)
    x = np.sort(np.concatenate([[-0.4, 0.4], rng.uniform(-0.4, 0.4, 40), 0.1 + rng.uniform(0, 1e-4, 40)]))
    vertices = np.array([(at, y, 1.0) for at in x for y in (-0.3, 0.3)])
    strips = [((2 * i, 2 * i + 1, 2 * i + 2), (2 * i + 1, 2 * i + 3, 2 * i + 2)) for i in range(len(x) - 1)]
    pair = draw(MIDDLE, as_open(vertices, np.array(strips).reshape(-1, 3)))
    assert_pairs_equal(pair, draw(MIDDLE, quad((-0.4, 0.4), (-0.3, 0.3), 1.0)))


@pytest.mark.parametrize("subdivisions", [3, 5])
def test_a_sphere_has_no_holes_and_its_analytic_size(subdivisions: int) -> None:
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.3)
    ball.apply_translation((0.1, -0.05, 1.2))
    pair = draw(MIDDLE, labelled(ball, 7, is_closed=True))
    is_hit = pair.part == 7
    for line in (*is_hit, *is_hit.T):
        hits = np.flatnonzero(line)
        assert not len(hits) or hits[-1] - hits[0] + 1 == len(hits)
    v, u = np.mgrid[:120, :160]
    ray = MIDDLE.backproject(np.stack([u, v], axis=-1), np.ones(u.shape))
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    centre = np.array((0.1, -0.05, 1.2))
    n_true = np.count_nonzero(centre @ centre - (ray @ centre) ** 2 <= 0.3**2)
    assert n_true * (0.97 if subdivisions == 3 else 0.997) <= is_hit.sum() <= n_true


def test_a_floor_seen_at_a_grazing_angle_has_its_analytic_depth() -> None:
    below = 0.02
    floor = np.array([(-30, below, -30), (30, below, -30), (30, below, 30), (-30, below, 30)])
    drawn = Renderer(MIDDLE, NEAR)
    drawn.render(EYE, as_open(floor, np.array([(0, 1, 2), (0, 2, 3)])))
    depth = drawn.depth_metres()[0]
    row = np.arange(120)
    expected = np.where(row > MIDDLE.cy, below * MIDDLE.fy / np.maximum(row - MIDDLE.cy, 0.1), 0.0)
    expected[(expected < NEAR) | (expected > 30)] = 0.0
    assert np.allclose(depth, expected[:, None], atol=1e-4)


def test_a_triangle_seen_edge_on_stays_within_its_own_depth() -> None:
    rng = np.random.default_rng(5)
    drawn = Renderer(MIDDLE, NEAR)
    n_pixels = 0
    for _ in range(300):
        ray = rng.uniform((-0.4, -0.3, 1.0), (0.4, 0.3, 1.0))
        aside = rng.normal(size=3) * (0.05, 0.05, 0.0)
        # the plane holds the eye, but for a hair: 1/z changes by metres from pixel to pixel
        corners = np.array([ray, 2.0 * ray + aside, 1.5 * ray - aside]) + rng.normal(0.0, 1e-3, (3, 3))
        drawn.render(EYE, as_open(corners, np.array([(0, 1, 2)])))
        depth = drawn.depth_metres()[0]
        n_pixels += np.count_nonzero(depth)
        assert (depth[depth > 0] > corners[:, 2].min() - 1e-4).all()
        assert (depth[depth > 0] < corners[:, 2].max() + 1e-4).all()
    assert n_pixels > 150


@pytest.mark.parametrize("size", [10.0, 1e3, 1e6])
def test_a_triangle_larger_than_the_view_fills_it(size: float) -> None:
    corners = np.array([(-size, -size, 2.0), (size, -size, 2.0), (0.0, 2 * size, 2.0)])
    for faces in ([(0, 1, 2)], [(0, 2, 1)]):
        pair = draw(MIDDLE, as_open(corners, np.array(faces), 9))
        assert (pair.depth == 2000).all()
        assert (pair.part == 9).all()


def test_nothing_is_drawn_of_what_lies_behind_or_too_near_or_too_far() -> None:
    empty = as_open(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    for mesh in (
        empty,
        quad((-1, 1), (-1, 1), -2.0),
        quad((-1, 1), (-1, 1), 0.2),
        quad((-99, 99), (-99, 99), 66.0),
    ):
        pair = draw(MIDDLE, mesh, RenderObject(mesh, 1, 3))
        for name in RenderedPair.__dataclass_fields__:
            assert not getattr(pair, name).any(), name
    assert_pairs_equal(draw(MIDDLE, None), draw(MIDDLE, empty))


def test_the_greatest_depth_is_kept() -> None:
    assert np.abs(draw(MIDDLE, quad((-99, 99), (-99, 99), 65.4)).depth.astype(int) - 65400).max() <= 3
    assert np.abs(draw(MIDDLE, quad((-99, 99), (-99, 99), 30.0)).depth.astype(int) - 30000).max() <= 1


def test_a_closed_mesh_cut_by_the_near_plane_shows_its_inside() -> None:
    box = labelled(trimesh.creation.box((1.0, 1.0, 1.0)), 0, is_closed=True)
    pair = draw(MIDDLE, None, RenderObject(box, 1, 1, translation(0.0, 0.0, 0.6)))
    assert pair.depth[60, 80] == 1100
    assert (pair.instance == 1).all()
    ahead = draw(MIDDLE, None, RenderObject(box, 1, 1, translation(0.0, 0.0, 1.0)))
    assert ahead.depth[60, 80] == 500


def test_back_faces_are_seen_on_open_meshes_alone() -> None:
    turned = quad((-0.2, 0.2), (-0.2, 0.2), 1.0)
    flipped = LabelledMesh(turned.vertices, turned.faces[:, ::-1].copy(), turned.face_label, False)
    assert_pairs_equal(draw(MIDDLE, turned), draw(MIDDLE, flipped))
    visible = [
        draw(MIDDLE, LabelledMesh(mesh.vertices, mesh.faces, mesh.face_label, True)).part.any()
        for mesh in (turned, flipped)
    ]
    assert visible == [False, True]  # counter-clockwise from outside is clockwise in (u right, v down)


@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_faces_and_objects_changes_no_byte(seed: int) -> None:
    scene = random_scene(seed)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(scene.body.faces))
    body = LabelledMesh(scene.body.vertices, scene.body.faces[order], scene.body.face_label[order], True)
    a, b = (Renderer(scene.camera, NEAR) for _ in range(2))
    first = a.render(scene.T_camera_world, scene.body, scene.objects)
    assert_pairs_equal(first, b.render(scene.T_camera_world, body, scene.objects[::-1]))
    other = random_scene(seed + 50)
    a.render(other.T_camera_world, other.body, other.objects)
    assert_pairs_equal(first, a.render(scene.T_camera_world, scene.body, scene.objects))


def test_a_scene_that_was_refused_leaves_nothing_behind() -> None:
    scene = random_scene(3)
    broken = quad((-1, 1), (-1, 1), 2.0)
    broken = LabelledMesh(broken.vertices * np.float32("inf"), broken.faces, broken.face_label, False)
    drawn = Renderer(scene.camera, NEAR)
    with pytest.raises(ValueError, match="not finite"):
        drawn.render(scene.T_camera_world, scene.body, [*scene.objects, RenderObject(broken, 1, 255)])
    assert_pairs_equal(drawn.render(scene.T_camera_world, None), Renderer(scene.camera).render(EYE, None))


def test_equal_depths_go_to_objects_then_to_the_higher_number() -> None:
    mesh = quad((-0.2, 0.2), (-0.2, 0.2), 1.0, 30)
    pair = draw(MIDDLE, mesh, RenderObject(mesh, 2, 7), RenderObject(mesh, 3, 5))
    assert set(np.unique(pair.instance)) == {0, 7}
    assert set(np.unique(pair.occluder)) == {0, 2}
    assert not pair.part.any()
    assert pair.object_pixels[5] == pair.object_pixels[7] == np.count_nonzero(pair.body_part == 30)
    both = LabelledMesh(mesh.vertices, np.tile(mesh.faces, (2, 1)), np.array([4, 4, 2, 2], np.uint8), False)
    assert set(np.unique(draw(MIDDLE, both).part)) == {0, 4}


@pytest.mark.parametrize("seed", range(4))
def test_a_mirrored_scene_gives_mirrored_images(seed: int) -> None:
    scene = random_scene(seed)
    camera = scene.camera
    turned = Camera(camera.width, camera.height, camera.fx, camera.fy, camera.width - 1 - camera.cx, camera.cy)
    flip = np.diag((-1.0, 1.0, 1.0, 1.0))

    def mirrored(mesh: LabelledMesh, T: np.ndarray) -> LabelledMesh:
        moved = mesh.transformed(flip @ scene.T_camera_world @ T)
        return LabelledMesh(moved.vertices, mesh.faces[:, ::-1].copy(), mesh.face_label, mesh.is_closed)

    pair = Renderer(camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    objects = [RenderObject(mirrored(o.mesh, o.T_world_mesh), o.class_code, o.instance) for o in scene.objects]
    other = Renderer(turned, NEAR).render(EYE, mirrored(scene.body, EYE), objects)
    for name in ("part", "occluder", "instance", "body_part"):
        # pixel centres on a side go to its left or top face in both: a few pixels differ
        assert np.count_nonzero(getattr(pair, name) != getattr(other, name)[:, ::-1]) <= 8, name
    is_same = pair.instance == other.instance[:, ::-1]
    error = np.abs(pair.depth.astype(int) - other.depth[:, ::-1])[is_same]
    assert np.count_nonzero(error > 1) <= 8


@pytest.mark.parametrize("seed", range(10))
def test_depth_is_there_exactly_where_a_label_is(seed: int) -> None:
    scene = random_scene(seed)
    pair = Renderer(scene.camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    assert np.array_equal(pair.depth > 0, (pair.part > 0) | (pair.occluder > 0))
    assert np.array_equal(pair.body_depth > 0, pair.body_part > 0)
    assert np.array_equal(pair.occluder > 0, pair.instance > 0)
    assert not ((pair.part > 0) & (pair.occluder > 0)).any()
    is_person = pair.part > 0
    assert np.array_equal(pair.part[is_person], pair.body_part[is_person])
    assert np.array_equal(pair.depth[is_person], pair.body_depth[is_person])
    assert (pair.depth <= pair.body_depth)[pair.body_depth > 0].all()


def test_a_turned_camera_sees_what_a_turned_scene_shows() -> None:
    scene = random_scene(11)
    T = np.eye(4)
    T[:3, :3] = axis_angle((0.0, 1.0, 0.0), 0.3)
    objects = [RenderObject(o.mesh, o.class_code, o.instance, T @ o.T_world_mesh) for o in scene.objects]
    drawn = Renderer(scene.camera, NEAR)
    first = drawn.render(scene.T_camera_world, scene.body, scene.objects)
    second = drawn.render(scene.T_camera_world @ np.linalg.inv(T), scene.body.transformed(T), objects)
    assert np.count_nonzero(first.part != second.part) <= 8
    assert np.count_nonzero(np.abs(first.depth.astype(int) - second.depth) > 1) <= 8


def test_bad_input_is_refused_in_one_sentence() -> None:
    mesh = quad((-1, 1), (-1, 1), 2.0)
    with pytest.raises(ValueError, match=r"instance=256 must be in 1\.\.255"):
        RenderObject(mesh, 1, 256)
    with pytest.raises(ValueError, match="instance=0 must be"):
        RenderObject(mesh, 1, 0)
    with pytest.raises(ValueError, match=r"class_code=12 must be in 1\.\.11, the codes of table, laptop"):
        RenderObject(mesh, 12, 1)
    with pytest.raises(ValueError, match="instance=4 is given twice"):
        draw(MIDDLE, None, RenderObject(mesh, 1, 4), RenderObject(mesh, 2, 4))
    with pytest.raises(ValueError, match=r"mesh of object 2 has faces with vertex indices 0\.\.9"):
        draw(MIDDLE, None, RenderObject(LabelledMesh(mesh.vertices, mesh.faces * 3, mesh.face_label, False), 1, 2))
    with pytest.raises(ValueError, match="body mesh has a vertex coordinate that is not finite"):
        draw(MIDDLE, LabelledMesh(mesh.vertices * np.float32("nan"), mesh.faces, mesh.face_label, False))
    with pytest.raises(ValueError, match=r"body mesh has face labels 0\.\.0, must be in 1\.\.31"):
        draw(MIDDLE, LabelledMesh(mesh.vertices, mesh.faces, mesh.face_label * 0, False))
    with pytest.raises(ValueError, match="near=0 must be in"):
        Renderer(MIDDLE, near=0)
    with pytest.raises(KeyError, match="unknown renderer 'vulkan', known are: numba, pyrender"):
        renderer("vulkan", MIDDLE)
