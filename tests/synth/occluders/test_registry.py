import json
from dataclasses import fields, replace

import numpy as np
import pytest
import trimesh

from synth.occluders.registry import GENERATORS, KINDS, from_plain, generator, make, sample, to_plain
from synth.occluders.solids.distance import solid_distances
from synth.vocabulary import OCCLUDER_CLASSES

EVERY_KIND = pytest.mark.parametrize("kind", list(GENERATORS))


def examples(kind, n, seed=11):
    rng = np.random.default_rng(seed)
    return [GENERATORS[kind].sample(rng) for _ in range(n)]


def test_every_occluder_class_has_a_generator():
    assert set(KINDS) == set(OCCLUDER_CLASSES) - {"none"}


@EVERY_KIND
def test_the_same_seed_gives_the_same_spec_and_the_same_bytes(kind):
    a, b = examples(kind, 3), examples(kind, 3)
    assert a == b
    assert make(a[0]).mesh.vertices.tobytes() == make(b[0]).mesh.vertices.tobytes()
    assert len(set(a)) == 3


@EVERY_KIND
def test_a_spec_survives_json(kind):
    for spec in examples(kind, 5):
        plain = json.loads(json.dumps(to_plain(spec)))
        assert plain["kind"] == kind
        assert from_plain(plain) == spec


@EVERY_KIND
def test_a_hundred_draws_are_all_within_their_limits_and_stand_on_the_floor(kind):
    for spec in examples(kind, 100):
        occluder = make(spec)
        assert abs(occluder.mesh.vertices[:, 2].min()) < 0.006
        assert occluder.class_name == GENERATORS[kind].class_name
        assert np.isfinite(occluder.mesh.vertices).all()
        assert (occluder.mesh.face_label == 0).all()


@EVERY_KIND
def test_the_number_of_triangles_is_reasonable(kind):
    least = 40 if kind in ("boxes", "bin") else 100
    for spec in examples(kind, 10):
        assert least <= len(make(spec).mesh.faces) <= 6000


@EVERY_KIND
def test_the_mesh_is_closed_exactly_if_it_says_so(kind):
    for spec in examples(kind, 5):
        occluder = make(spec)
        mesh = trimesh.Trimesh(occluder.mesh.vertices, occluder.mesh.faces, process=False)
        assert mesh.is_watertight == occluder.mesh.is_closed
        assert mesh.is_winding_consistent


@EVERY_KIND
def test_faces_of_closed_parts_look_outwards(kind):
    for spec in examples(kind, 5):
        occluder = make(spec)
        mesh = trimesh.Trimesh(occluder.mesh.vertices, occluder.mesh.faces, process=False)
        for piece in mesh.split(only_watertight=True):
            assert piece.volume > 0


@EVERY_KIND
def test_surface_anchors_lie_on_the_object(kind):
    for spec in examples(kind, 8):
        occluder = make(spec)
        for anchor in occluder.anchors:
            T = anchor.T_object_anchor
            np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
            assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
            distance = solid_distances(occluder.solids, np.eye(4), T[None, :3, 3])[0]
            if anchor.name.startswith("handle"):
                assert -0.03 < distance < 0, (spec, anchor)
            elif not anchor.name.startswith(("backrest", "base")):
                assert abs(distance) < 0.003, (spec, anchor)


def test_grips_run_to_the_users_left_at_a_height_for_hands():
    for kind in KINDS["stroller"]:
        for spec in examples(kind, 20):
            occluder = make(spec)
            left, right = occluder.anchor("handle_left"), occluder.anchor("handle_right")
            assert left.T_object_anchor[1, 3] > right.T_object_anchor[1, 3]
            for anchor in (left, right):
                assert anchor.T_object_anchor[1, 1] > 0.8
                assert anchor.T_object_anchor[0, 0] > 0.7
                assert 0.85 < anchor.T_object_anchor[2, 3] < 1.15
                assert anchor.T_object_anchor[0, 3] < -0.3


def test_backrests_face_the_sitters_forward_and_lean_back():
    for kind in ("dining_chair", "folding_chair", "office_chair", "sofa"):
        for spec in examples(kind, 10):
            occluder = make(spec)
            back, seat = occluder.anchor("backrest").T_object_anchor, occluder.anchor("seat").T_object_anchor
            assert back[0, 2] > 0.8
            assert back[2, 2] >= 0
            assert back[0, 3] < seat[0, 3]
            assert back[2, 3] > seat[2, 3]


def test_the_laptop_opens_from_shut_to_flat_about_its_hinge():
    spec = sample("laptop", np.random.default_rng(0))
    heights = [np.ptp(make(replace(spec, hinge_angle=a)).mesh.vertices[:, 2]) for a in (0.0, np.pi / 2, np.pi)]
    thin = spec.deck_thickness + spec.screen_thickness
    assert heights[0] == pytest.approx(thin, abs=0.006)
    assert heights[1] == pytest.approx(spec.depth + spec.deck_thickness, abs=0.01)
    assert heights[2] < thin + 0.02


def test_a_shut_laptops_screen_faces_its_keyboard():
    spec = sample("laptop", np.random.default_rng(0), hinge_angle=0.0)
    x = make(spec).mesh.vertices[:, 0]
    assert np.ptp(x) == pytest.approx(spec.depth, abs=0.012)


def test_tables_leave_room_for_knees():
    for kind in ("table", "desk"):
        for spec in examples(kind, 30):
            solids = make(spec).solids
            # A block as wide as both thighs, 15 cm in from the edge and up to 62 cm high.
            y, z = np.meshgrid(np.linspace(-0.2, 0.2, 9), np.linspace(0.3, 0.6, 7))
            y_middle = 0.0
            if kind == "desk" and spec.drawers != "both":
                y_middle = (spec.drawer_width + 0.02) / 2 * (-1 if spec.drawers == "left" else 1)
            points = np.stack([np.full(y.size, -spec.depth / 2 + 0.12), y.ravel() + y_middle, z.ravel()], 1)
            assert solid_distances(solids, np.eye(4), points).min() > 0, spec


def test_constraints_fix_kind_and_fields():
    rng = np.random.default_rng(0)
    spec = sample("table", rng, kind="desk", height=0.7)
    assert type(spec).__name__ == "DeskSpec"
    assert spec.height == 0.7


def test_coffee_tables_come_only_when_asked_for():
    rng = np.random.default_rng(0)
    assert all(sample("table", rng).height > 0.7 for _ in range(60))
    assert sample("table", rng, kind="coffee_table").height < 0.56


@pytest.mark.parametrize(
    ("plain", "message"),
    [
        ({"kind": "throne"}, "unknown kind of object 'throne', known are table, desk"),
        ({}, "unknown kind of object None, known are table"),
        ({"kind": "bin", "radius": 0.2, "colour": "red"}, "BinSpec has no field colour, only radius, foot"),
        ({"kind": "bin", "radius": 0.2}, "BinSpec lacks foot, height, has_rim"),
    ],
)
def test_plain_values_that_are_no_spec_get_one_clear_error(plain, message):
    with pytest.raises(ValueError, match=message):
        from_plain(plain)


@pytest.mark.parametrize("value", [-0.2, 0.0, 1e6, float("nan"), float("inf"), "wide", None, True])
@EVERY_KIND
def test_negative_absurd_and_non_numeric_sizes_are_refused(kind, value):
    spec = examples(kind, 1)[0]
    name = next(f.name for f in fields(spec) if f.metadata["type"] is float and f.metadata["low"] > 0)
    with pytest.raises(ValueError, match=f"{name}=.* must be"):
        replace(spec, **{name: value})


def test_unknown_classes_kinds_and_fields_list_the_known_ones():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="unknown occluder class 'lamp', known are table, laptop, stroller"):
        sample("lamp", rng)
    with pytest.raises(ValueError, match="class 'chair' has no kind 'bench', only dining_chair, office_chair"):
        sample("chair", rng, kind="bench")
    with pytest.raises(ValueError, match="DeskSpec has no field colour, only depth, width"):
        sample("table", rng, kind="desk", colour="red")
    with pytest.raises(ValueError, match="unknown kind of object 7"):
        generator(7)


def test_sizes_that_do_not_fit_each_other_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="a round top has one diameter"):
        replace(sample("table", rng, kind="table"), top="round", depth=0.8, width=1.0)
    with pytest.raises(ValueError, match="for the knees"):
        replace(sample("table", rng, kind="desk"), drawers="both", width=1.2, drawer_width=0.4)


def test_a_missing_anchor_is_named_with_those_there_are():
    with pytest.raises(KeyError, match="suitcase has no anchor 'seat'"):
        make(sample("suitcase", np.random.default_rng(0))).anchor("seat")
