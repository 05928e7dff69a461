"""Runs the kernels on tiny inputs; numba checks every index if NUMBA_BOUNDSCHECK=1 is set before the start.

Prints the names of what ran. The last one reads out of range on purpose: without the checks, the script fails.
"""

import numpy as np

from forests.crops import Crops, CropWriter, crop_image
from forests.finder.find import PeopleFinder
from forests.finder.floor import Floor, find_floor
from forests.finder.model import template_scores
from forests.finder.probes import contour, view_of
from forests.frames import Hints, Intrinsics, LabelTable
from forests.growing import GrowthConfig, grow_class_tree, grow_direction_tree
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.descend import descend, flatten
from forests.oarf.leaves import LeafRules, leaf_table
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.tune import untuned
from forests.rwf.clusters import leaf_clusters
from forests.rwf.model import ExpertTree, WalkPlan
from forests.rwf.points import draw_way_points, farthest_behind, growth_targets
from forests.rwf.tables import pack_experts, walk_tables
from forests.rwf.walk import walk_skeleton
from forests.samples import Samples, TrainingSet, draw_pixels
from forests.skeleton.answers import edges_of
from synth.bodies.body import Pose
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.rig.collision import excess_depth
from synth.bodies.rig.skinning import lowest_before, pose_skin
from synth.bodies.shape.make import make_body
from synth.bodies.spec import sample_body
from synth.camera import Camera
from synth.geometry import LabelledMesh, extent, thinned, translation, within
from synth.occluders.model import BOX, Solids
from synth.occluders.solids.distance import is_any_nearer, nearest_point, place
from synth.render.rasterize import Renderer
from synth.scene.room.occupancy import Occupancy, footprint

CAMERA = Intrinsics(40.0, 40.0, 15.5, 11.5)
LABELS = LabelTable(("upper", "lower"), ("box",), ("neck", "hand"))
GROWTH = GrowthConfig(max_depth=4, n_candidates=40, min_samples_leaf=3)
JOINTS = np.array([[[0.0, -0.2, 2.1], [0.2, 0.1, 2.0]]], np.float32)


def image() -> tuple[np.ndarray, np.ndarray]:
    """(24, 32) depth [mm] and labels that touch the image's border; with a hole."""
    depth, label = np.zeros((24, 32), np.uint16), np.zeros((24, 32), np.uint8)
    depth[0:20, 4:24], label[0:10, 4:24], label[10:20, 4:24] = 2000, 1, 2
    depth[14:24, 20:32], label[14:24, 20:32] = 1500, 3
    depth[5:8, 10:12], label[5:8, 10:12] = 0, 0
    depth[depth > 0] += np.random.default_rng(0).integers(0, 50, (depth > 0).sum()).astype(np.uint16)
    return depth, label


def learned(crops: Crops) -> TrainingSet:
    depth, label = image()
    row, column = draw_pixels(label, LABELS.n_parts, 150, 60, 0, 0).T
    left, top = crops.origin[0]
    places = (column - left).astype(np.int16), (row - top).astype(np.int16)
    return TrainingSet(
        crops, Samples(np.zeros(len(row), np.int32), *places, depth[row, column], label[row, column]), JOINTS
    )


def regression_forest(training: TrainingSet) -> OARFModel:
    config = OARFConfig(n_trees=1, n_voting_pixels=60, growth=GROWTH)
    classes = ClassTable.of(LABELS, config.mode)
    wanted = classes.of_label(LABELS)[training.samples.label]
    grown = grow_class_tree(training.crops, training.samples, wanted, classes.n_classes, GROWTH, 0, 0, 1)
    rules = LeafRules(classes.n_classes, classes.n_parts, 0.05, config.n_leaf_votes, 0, 0, n_drawn=20, n_starts=8)
    leaves = pack_leaves(leaf_table(training, wanted, grown, rules))
    tree = ForestTree(grown.nodes, leaves, grown.hints if len(grown.hints) else None)
    return OARFModel(config, LABELS, classes, (tree,), untuned(LABELS.n_joints))


def predict() -> None:
    """Growing, leaves, descent, votes and peaks; voters everywhere and in a box over the border."""
    depth, _ = image()
    predictor = Predictor(regression_forest(learned(crop_image(depth, CAMERA))))
    for box in (None, (-5, -5, 200, 12)):
        assert np.isfinite(predictor.predict(depth, CAMERA, box).joints).all()
    assert (predictor.label_pixels(depth, CAMERA) > 0).sum() == (depth > 0).sum()
    assert np.isnan(predictor.predict(np.zeros_like(depth), CAMERA).joints).all()


def predict_told() -> None:
    """Trees that ask for classes and facts beside depth, where depth tells nothing."""
    depth, label = image()
    hints = Hints(label, np.array([7, -7], np.int16))
    with CropWriter(2**20) as writer:
        writer.add(depth, CAMERA, hints)
        crops = writer.finish()
    predictor = Predictor(regression_forest(learned(crops)))
    assert predictor.asks_for_hints
    assert np.isfinite(predictor.given(hints).predict(depth, CAMERA).joints).all()


def walk() -> None:
    """Way points, offsets' trees, clusters, and walks that start outside the image too."""
    depth, _ = image()
    crops = crop_image(depth, CAMERA)
    joint, start = np.ascontiguousarray(JOINTS[:, 0]), np.float32([[0.1, 0.1, 2.0]])
    gate = np.float32([0.05, farthest_behind(crops, joint, 0.0)])
    points = draw_way_points(crops, joint, start, gate, 80, 0.5, 0.3, 0.1, 0, 0)
    grown = grow_direction_tree(crops, points.samples, growth_targets(points.offsets, 0.5), GROWTH, 0, 0, 1)
    tree = ExpertTree(grown.nodes, *leaf_clusters(grown, points.offsets, 2, 0.1))
    tables, one = walk_tables(pack_experts(((tree,),))), np.ones(1, np.float32)
    root, none, metres, n_walks = np.zeros(1, np.int32), np.int32([-1]), 0.1 * one, np.int32([3])
    plan = WalkPlan(root, none, metres, metres, np.int32([1]), gate[None, None], n_walks, 5)
    ends, said, edges = (
        np.empty((1, 3, 4), np.float32),
        np.empty((1, 3), np.float32),
        edges_of(depth.shape, CAMERA),
    )
    intrinsics = np.float32([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
    for start in ((0.1, 0.1, 2.0), (-9.0, 9.0, 0.5)):
        walk_skeleton(depth, intrinsics, tables, plan, np.float32(start), 0, edges, ends, said)
        assert np.isfinite(ends[:, 0]).all()


def render() -> None:
    """Triangles inside, across every border, and through the near plane."""
    corners = np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = np.int32([[0, 1, 2], [0, 2, 3]])
    renderer = Renderer(Camera(20, 16, 15.0, 15.0, 9.5, 7.5))
    for size, z, is_seen in ((0.2, 2.0, True), (30.0, 2.0, True), (1.0, 0.3, False)):
        vertices = corners * np.float32(size) + np.float32([0.3, 0.2, z])
        vertices[0, 2] -= np.float32(0.2)
        mesh = LabelledMesh(vertices, faces, np.uint8([1, 2]), False)
        pair = renderer.render(np.eye(4), mesh)
        assert (pair.body_depth > 0).any() == is_seen


def nearest() -> None:
    """Points in, at and far from a box."""
    solids = Solids(np.uint8([BOX]), np.eye(4)[None], np.array([[1.0, 1.0, 1.0]]))
    distance, _ = nearest_point(solids, translation(0.0, 0.0, 1.0), np.random.default_rng(0).normal(size=(50, 3)))
    assert np.isfinite(distance)
    points = np.random.default_rng(1).normal(size=(50, 3))
    placed = place(solids, translation(0.0, 0.0, 1.0))
    assert is_any_nearer(placed, points, 0.1)
    assert not is_any_nearer(placed, points, -2.0)


def spread() -> None:
    """Points in boxes and cells, on floor inside a grid and beyond its borders."""
    points = np.random.default_rng(2).normal(size=(60, 3))
    low, high = extent(points)
    assert len(within(points, low, high)) == len(points)
    assert len(thinned(points, 0.5)) < len(points)
    floor = Occupancy(2.0, 1.0)
    floor.take(footprint(points)[:9], 0.2)
    for point in points:
        floor.is_free(point[None, :2])


def body() -> None:
    """A skin, its profiles and landmarks, all of it posed and some."""
    person = make_body(sample_body(np.random.default_rng(0)))
    marks = landmarks_of(person)
    links, skin = pose_skin(person, person.bind_angles, np.eye(4))
    _, foot = pose_skin(person, person.bind_angles, np.eye(4), marks.side["l"].foot)
    assert lowest_before(foot, np.inf) >= lowest_before(skin, np.inf)
    assert excess_depth(person, Pose(person.bind_angles, links[0])) <= 0.0


def find() -> None:
    """Places at every border of the image, with a floor and without; the floor itself."""
    rows, columns = np.mgrid[:96, :128]
    depth = np.where(rows > 50, 60_000 // np.maximum(rows - 40, 1), 0).astype(np.uint16)
    depth[:40, 100:], depth[20:96, 50:70], depth[60:, :9] = 900, 1500, 700
    depth[columns % 17 == 3] = 0
    camera, finder = Intrinsics(90.0, 90.0, 63.5, 47.5), PeopleFinder()
    for floor in (Floor.of_camera(0.2, 1.2), None):
        finder.find(depth, camera, floor, score=-50.0)
        view = view_of(depth, camera, floor)
        template_scores(view, contour(view), finder.model.template)
    find_floor(np.where(rows > 50, 60_000 // np.maximum(rows - 40, 1), 0).astype(np.uint16), camera)


def read_out_of_range() -> None:
    """A root beyond the last node."""
    depth, _ = image()
    crops = crop_image(depth, CAMERA)
    tree = regression_forest(learned(crops)).trees[0]
    flat = flatten([tree.nodes], [tree.leaves.n_leaves])
    one, leaves = np.full(1, 9, np.int32), np.empty((1, 1), np.int32)
    beyond = flat.roots + np.int32(len(flat.nodes))
    try:
        descend(
            crops.pixels, int(crops.width[0]), int(crops.height[0]), one, one, np.float32(40), np.float32(40),
            flat.nodes, beyond, leaves,
        )  # fmt: skip
    except IndexError:
        return
    raise AssertionError("an index out of range was not found: is NUMBA_BOUNDSCHECK=1 set?")


if __name__ == "__main__":
    for kernels in (predict, predict_told, walk, render, nearest, spread, body, find, read_out_of_range):
        kernels()
        print(kernels.__name__)  # noqa: T201
