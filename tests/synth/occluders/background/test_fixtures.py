import json

import numpy as np
import pytest
import trimesh

from synth.occluders.background.catalogue import FIXTURES, from_plain, make, sample, to_plain
from synth.occluders.background.hanging import CurtainSpec
from synth.occluders.background.shelf import ShelfSpec
from synth.occluders.solids.distance import solid_distances

EVERY_KIND = pytest.mark.parametrize("kind", list(FIXTURES))
HANGING = ("curtain", "radiator", "panel")


def examples(kind, n=6):
    rng = np.random.default_rng(3)
    return [sample(kind, rng) for _ in range(n)]


@EVERY_KIND
def test_a_spec_becomes_plain_values_and_back(kind):
    for spec in examples(kind):
        assert from_plain(json.loads(json.dumps(to_plain(spec)))) == spec


@EVERY_KIND
def test_what_does_not_hang_on_a_wall_stands_on_the_floor_and_nothing_is_below_it(kind):
    for spec in examples(kind):
        bottom = make(spec).mesh.vertices[:, 2].min()
        assert bottom >= -1e-6
        assert (bottom < 1e-6) == (kind not in HANGING), spec


@EVERY_KIND
def test_every_part_is_closed_and_turned_outwards(kind):
    for spec in examples(kind, 3):
        mesh = make(spec).mesh
        for part in trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).split(only_watertight=False):
            merged = trimesh.Trimesh(part.vertices, part.faces, process=True)
            assert merged.is_watertight
            assert merged.volume > 0.0


@EVERY_KIND
def test_mesh_and_solids_agree_to_a_centimetre(kind):
    for spec in examples(kind, 3):
        occluder = make(spec)
        mesh = trimesh.Trimesh(occluder.mesh.vertices, occluder.mesh.faces, process=False)
        points, _ = trimesh.sample.sample_surface(mesh, 3000, seed=1)
        assert solid_distances(occluder.solids, np.eye(4), points).max() < 0.01, spec


@EVERY_KIND
def test_all_parts_of_one_thing_hold_together(kind):
    """Nothing floats: from the floor (or the wall) every solid is reached over solids that touch."""
    for spec in examples(kind):
        solids = make(spec).solids
        meshes = []
        for row in zip(solids.kind, solids.T_object_solid, solids.size, strict=True):
            box = trimesh.creation.box(2 * row[2] + (0, 0, 2 * row[2][0] * (row[0] == 2)), row[1])
            meshes.append(box)
        reached, waiting = [0], set(range(1, len(meshes)))
        while reached:
            here = meshes[reached.pop()]
            touching = {
                k
                for k in waiting
                if (meshes[k].bounds[0] <= here.bounds[1] + 0.005).all()
                and (meshes[k].bounds[1] >= here.bounds[0] - 0.005).all()
            }
            waiting -= touching
            reached += touching
        assert not waiting, spec


@pytest.mark.parametrize(
    ("spec_type", "changes", "sentence"),
    [
        (ShelfSpec, {"height": 0.5, "n_boards": 8}, "at least 0.12 is needed"),
        (CurtainSpec, {"top": 1.0, "bottom": 0.9}, "must be 0.3 m above"),
    ],
)
def test_sizes_that_do_not_fit_each_other_are_refused(spec_type, changes, sentence):
    plain = examples("shelf" if spec_type is ShelfSpec else "curtain", 1)[0].to_plain() | changes
    with pytest.raises(ValueError, match=sentence):
        spec_type.from_plain(plain)


def test_an_unknown_kind_names_the_known_ones():
    with pytest.raises(ValueError, match="unknown kind of object 'throne', known are table"):
        from_plain({"kind": "throne"})
