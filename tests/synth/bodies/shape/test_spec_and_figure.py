"""BodySpec, its statistics, and how a body follows its measures."""

import dataclasses
import json

import numpy as np
import pytest

from synth.bodies.body import Pose
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.figure import DENSITY, enclosed_volume
from synth.bodies.shape.make import make_body, sole_height
from synth.bodies.skeleton import DOF_IDX, N_DOFS
from synth.bodies.spec import BOTTOMS, HAIRS, HEADWEARS, SHOES, TOPS, BodySpec, sample_body

NAKED = [
    BodySpec(1.76, 78.0, 1.0, 30.0),
    BodySpec(1.63, 62.0, 0.0, 30.0),
    BodySpec(1.75, 118.0, 1.0, 45.0),
    BodySpec(1.60, 98.0, 0.0, 55.0),
    BodySpec(1.80, 58.0, 1.0, 20.0),
    BodySpec(1.10, 19.0, 1.0, 5.0),
    BodySpec(1.40, 34.0, 0.0, 10.0),
]


def upright(body):
    return pose_vertices(body, Pose(np.zeros(N_DOFS), np.eye(4)))


@pytest.mark.parametrize("spec", NAKED)
def test_a_naked_body_stands_as_tall_and_weighs_as_much_as_its_spec_says(spec):
    body = make_body(spec)
    height = np.ptp(upright(body)[:, 2])
    assert height == pytest.approx(spec.stature, abs=0.01)
    mass = DENSITY * enclosed_volume(body.mesh.vertices.astype(np.float64), body.mesh.faces)
    assert mass == pytest.approx(spec.mass, rel=0.03)


def test_more_mass_gives_more_volume_and_a_wider_waist():
    volumes, depths = [], []
    for mass in (48.0, 60.0, 75.0, 95.0, 120.0):
        mesh = make_body(BodySpec(1.70, mass, 0.4, 40.0)).mesh
        volumes.append(enclosed_volume(mesh.vertices.astype(np.float64), mesh.faces))
        waist = mesh.vertices[(np.abs(mesh.vertices[:, 2] - 0.16) < 0.02) & (np.abs(mesh.vertices[:, 1]) < 0.2)]
        depths.append(np.ptp(waist[:, 0]))
    assert np.all(np.diff(volumes) > 0)
    assert np.all(np.diff(depths) > 0)


def test_soles_stand_on_one_plane_that_the_skeleton_knows():
    for spec in (NAKED[0], dataclasses.replace(NAKED[1], shoes="shoe", sole=0.03)):
        body = make_body(spec)
        vertices = upright(body)
        ankle = -sum(-body.skeleton.offsets[i, 2] for i in _leg_dofs())
        assert vertices[:, 2].min() == pytest.approx(ankle - sole_height(body), abs=2e-3)


def _leg_dofs():
    from synth.bodies.skeleton import DOF_IDX

    return [DOF_IDX["l_knee_flexion"], DOF_IDX["l_ankle_flexion"]]


def test_the_same_seed_draws_the_same_person_and_plain_json_makes_it_again():
    spec = sample_body(np.random.default_rng(5))
    assert spec == sample_body(np.random.default_rng(5))
    again = BodySpec(**json.loads(json.dumps(spec.plain())))
    assert again == spec
    assert make_body(spec).mesh.vertices.tobytes() == make_body(again).mesh.vertices.tobytes()


def test_adults_follow_the_published_means():
    rng = np.random.default_rng(0)
    people = [sample_body(rng, child_share=0.0) for _ in range(3000)]
    for sex, mean in ((0, 159.9), (1, 172.8)):
        statures = np.array([100 * p.stature for p in people if round(p.sex) == sex])
        assert statures.mean() == pytest.approx(mean, abs=0.8)
        assert 6.5 < statures.std() < 8.5
    index = np.array([p.mass / p.stature**2 for p in people])
    assert 24.0 < np.median(index) < 27.5
    assert (index < 19).mean() > 0.02
    assert (index > 35).mean() > 0.02


def test_children_grow_with_age_and_have_their_share():
    rng = np.random.default_rng(1)
    people = [sample_body(rng) for _ in range(2000)]
    children = [p for p in people if p.age < 18]
    assert 0.12 < len(children) / len(people) < 0.18
    young = np.mean([p.stature for p in children if p.age < 7])
    old = np.mean([p.stature for p in children if p.age > 14])
    assert young < 1.2 < 1.6 < old


def test_a_childs_head_is_larger_for_its_stature():
    def share(spec):
        body = make_body(spec)
        head = body.mesh.vertices[np.unique(body.mesh.faces[np.isin(body.mesh.face_label, (1, 2, 3, 4))])]
        return np.ptp(head[:, 2]) / spec.stature

    assert share(NAKED[5]) > 1.2 * share(NAKED[0])


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("stature", 3.0, "stature=3.0 must be in"),
        ("mass", -1.0, "mass=-1.0 must be in"),
        ("mass", 200.0, "mass index of"),
        ("sex", 2.0, "sex=2.0 must be in"),
        ("top", "toga", "must be one of bare, tight"),
        ("belly", 4.0, "belly=4.0 must be in"),
        ("sole", float("nan"), "sole=nan must be in"),
    ],
)
def test_bad_measures_get_one_clear_error(field, value, says):
    with pytest.raises(ValueError, match=says):
        dataclasses.replace(NAKED[0], **{field: value})


def test_every_garment_can_be_worn():
    base = BodySpec(1.7, 70.0, 0.5, 30.0, top_ease=0.01, bottom_ease=0.01, hair_volume=0.02, sole=0.02)
    plain = make_body(base).mesh.vertices
    for field, kinds in (
        ("top", TOPS),
        ("bottom", BOTTOMS),
        ("hair", HAIRS),
        ("headwear", HEADWEARS),
        ("shoes", SHOES),
    ):
        for kind in kinds:
            vertices = make_body(dataclasses.replace(base, **{field: kind})).mesh.vertices
            assert np.isfinite(vertices).all()
            if kind not in ("bare", "bald", "none"):
                same = vertices.shape == plain.shape and np.abs(vertices - plain).max() < 1e-3
                assert not same, f"{field}={kind} changes nothing"


@pytest.mark.parametrize(("sex", "forearm"), [(0.0, 0.144), (1.0, 0.151)])
def test_arms_of_average_adults_are_as_long_as_published(sex, forearm):
    offsets = make_body(BodySpec(1.70, 68.0, sex, 30.0)).skeleton.offsets
    lengths = [-offsets[DOF_IDX[f"l_{name}_flexion"], 2] / 1.70 for name in ("elbow", "wrist")]
    assert lengths == pytest.approx(
        [0.160, forearm], abs=0.004
    )  # de Leva 1996: 0.16 and 0.152-0.154; Winter: 0.145
