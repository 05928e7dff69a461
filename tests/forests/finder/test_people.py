"""People are found where they stand; kernels equal their slow twins; nothing breaks on poor images."""

from dataclasses import replace

import numpy as np
import pytest

from forests.finder.find import APART_M, PeopleFinder
from forests.finder.floor import FloorPrior
from forests.finder.model import Trees, read_finder, template_scores, tree_scores, write_finder
from forests.finder.probes import FINE, N_FEATURES, PROBES, contour, features_at, view_of
from forests.modelfile import ModelFileError
from tests import reference_finder as reference
from tests.reference_finder import CAMERA, SIZE, cast, figure, standing


@pytest.fixture(scope="module")
def finder():
    return PeopleFinder()


def scene(*places, floor=None, **others):
    bodies = [part for place in places for part in figure(*place)]
    return cast(floor or standing(), bodies, wall=5.5, **others)


def test_nobody_is_found_in_an_empty_room(finder):
    assert len(finder.find(scene(), CAMERA)) == 0


@pytest.mark.parametrize("pitch", [-0.05, 0.15, 0.35])
def test_people_are_found_where_they_stand(finder, pitch):
    places = [(2.4, -0.6), (3.2, 0.5)]
    floor = standing(pitch, 1.5)
    found = finder.find(scene(*places, floor=floor), CAMERA)
    assert len(found) == 2
    for x, y in places:
        person = min(found, key=lambda one: np.hypot(one.place[0] - x, one.place[1] - y))
        assert np.hypot(person.place[0] - x, person.place[1] - y) < 0.12
        assert person.place[2] == 0
        assert person.height == pytest.approx(1.75, abs=0.06)
        assert person.distance == pytest.approx(np.hypot(x, y), abs=0.12)
        in_floor = found.floor.T_floor_camera[:3, :3] @ person.axis + found.floor.T_floor_camera[:3, 3]
        assert in_floor[:2] == pytest.approx(person.place[:2])
        left, top, right, bottom = person.box
        assert 0 <= left < right <= SIZE[1]
        assert 0 <= top < bottom <= SIZE[0]


def test_a_box_holds_the_pixels_of_the_person_and_no_floor(finder):
    floor = standing(0.2, 1.5)
    (person,) = finder.find(scene((2.8, 0.0), floor=floor), CAMERA, floor)
    rows, columns = np.nonzero(scene((2.8, 0.0), floor=floor) != scene(floor=floor))
    box = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
    assert np.abs(np.array(person.box) - box).max() <= 5


def test_the_surest_come_first_and_keep_apart(finder):
    never = finder.model.trees._replace(floor_of=np.full(len(finder.model.trees.feature), -np.inf, np.float32))
    patient = PeopleFinder(replace(finder.model, trees=never))
    people = patient.find(scene((2.4, -0.6), (3.2, 0.5), (3.9, -1.0)), CAMERA, score=-9.0).people
    assert len(people) >= 3
    assert [one.score for one in people] == sorted((one.score for one in people), reverse=True)
    places = np.array([one.place for one in people])
    gaps = np.linalg.norm(places[:, None] - places[None], axis=2)[np.triu_indices(len(people), 1)]
    assert gaps.min() >= APART_M


def test_a_higher_score_keeps_fewer_of_the_same(finder):
    depth = scene((2.4, -0.6), (3.2, 0.5))
    many, few = (finder.find(depth, CAMERA, score=score).people for score in (-4.0, 2.0))
    assert {one.box for one in few} <= {one.box for one in many}


@pytest.mark.parametrize("what", ["empty", "near", "full", "one pixel", "tiny"])
def test_poor_images_are_searched_without_harm(finder, what):
    depth = np.zeros(SIZE, np.uint16)
    if what == "near":
        depth[:] = 100
    if what == "full":
        depth = cast(standing(0.0, 1.3), figure(0.55, 0.0))
    if what == "one pixel":
        depth[0, 0] = 2000
    if what == "tiny":
        depth = np.full((1, 1), 2000, np.uint16)
    found = finder.find(depth, CAMERA)
    assert len(found) <= (1 if what == "full" else 0)


def test_without_a_floor_heights_are_unknown_and_what_is_known_of_it_helps(finder):
    depth = scene((2.4, 0.0), floor=standing(0.05, 1.5))
    depth[140:] = 0
    found = finder.find(depth, CAMERA)
    assert found.floor is None
    assert all(np.isnan(one.height) for one in found)
    known = finder.find(depth, CAMERA, FloorPrior(pitch=0.05, height=1.5))
    assert [round(one.height, 1) for one in known] == [1.8] or [round(one.height, 1) for one in known] == [1.7]


def test_edges_equal_the_slow_twin():
    floor, depth = standing(), scene((2.4, -0.6), (3.2, 0.5))
    tops = contour(view_of(depth, CAMERA, floor))
    slow = reference.slow_contour(depth, CAMERA, floor, max(1, round(0.04 * CAMERA.fx / 5.0)))
    found = {(int(u), int(v)) for u, v, _ in tops}
    assert found <= slow
    assert {(int(u), int(v)) for u, v, _ in contour(view_of(depth, CAMERA, None))} == slow
    assert all(reference.is_tall(reference.slow_height(CAMERA, floor, top)) for top in tops)
    assert len(found) > 30


@pytest.mark.parametrize("is_floored", [True, False])
def test_features_and_scores_equal_the_slow_twins(finder, is_floored):
    floor, depth = standing(0.3), scene((2.4, -0.6), (3.2, 0.5), floor=standing(0.3))
    depth[60:70, 100:140] = 0
    floor = floor if is_floored else None
    view = view_of(depth, CAMERA, floor)
    tops = contour(view)[::7]
    fast = features_at(view, tops)
    slow = np.array(
        [[reference.slow_feature(depth, CAMERA, floor, t, k) for k in range(N_FEATURES)] for t in tops]
    )
    # A probe whose place lies on the border of two pixels may read either.
    assert (np.abs(fast - slow) < 1e-4).mean() > 0.999
    trees = finder.model.trees
    assert tree_scores(view, tops, trees).tolist() == [reference.slow_score(row, trees) for row in fast]
    template = finder.model.template
    patches = np.minimum(fast[:, : FINE * FINE], 1.0).reshape(-1, FINE, FINE)
    slow = [-np.sqrt(((patch - template) ** 2).mean()) for patch in patches.astype(np.float64)]
    assert template_scores(view, tops, template) == pytest.approx(slow, abs=1e-5)


def test_giving_up_early_changes_no_score_that_is_reached(finder):
    view = view_of(scene((2.4, -0.6), (3.2, 0.5)), CAMERA, standing())
    tops, trees = contour(view), finder.model.trees
    early = tree_scores(view, tops, trees)
    whole = tree_scores(view, tops, trees._replace(floor_of=np.full(len(trees.feature), -np.inf, np.float32)))
    assert np.isfinite(whole).all()
    assert (np.isinf(early) | (early == whole)).all()
    assert np.isinf(early).any()


def test_a_model_survives_its_file_and_a_wrong_one_is_refused(finder, tmp_path):
    path = tmp_path / "model.safetensors"
    write_finder(path, finder.model)
    again = read_finder(path)
    assert all(np.array_equal(a, b) for a, b in zip(again.trees, finder.model.trees, strict=True))
    assert np.array_equal(again.template, finder.model.template)
    assert (again.score, again.facts) == (finder.model.score, finder.model.facts)
    first = path.read_bytes()
    write_finder(path, again)
    assert path.read_bytes() == first
    path.write_bytes(first[:-3] + bytes(3))
    with pytest.raises(ModelFileError, match="damaged"):
        read_finder(path)
    trees = Trees(*(values.copy() for values in finder.model.trees))
    trees.feature[0, 0] = len(PROBES) + 2
    write_finder(path, replace(finder.model, trees=trees))
    with pytest.raises(ModelFileError, match="features 0"):
        read_finder(path)


def test_depth_of_another_kind_is_refused(finder):
    with pytest.raises(ValueError, match="must be integer millimetres"):
        finder.find(np.ones(SIZE), CAMERA)
