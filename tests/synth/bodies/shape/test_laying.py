import numpy as np
import pytest

from synth.bodies.shape.figure import enclosed_volume, laid_half, solved_figure
from synth.bodies.shape.laying import lay_skin, laying_of
from synth.bodies.shape.make import evened
from synth.bodies.shape.segments import LAYOUT, SEGMENTS, radius_at
from synth.bodies.shape.template import LEAST_ASIDE, mirrored_vertices, template
from synth.bodies.spec import sample_body

FIGURE = solved_figure(sample_body(np.random.default_rng(3)), template("template"), 1.0)


def laid_slowly(axes, table, segment, share, coords) -> np.ndarray:
    """Where one point lies, by its coordinates about each segment."""
    out = np.zeros(3)
    for seg, weight, (station, angle, factor) in zip(segment, share, coords, strict=True):
        if seg < 0:
            continue
        r = factor * radius_at(table, LAYOUT, seg, station, angle)
        if LAYOUT.n_bones[seg] == 0:
            polar = station / (LAYOUT.n_stations[seg] - 1) * np.pi
            way = np.array([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)])
            out += weight * (axes.origin[seg, 0] + r * way)
            continue
        before = np.concatenate([[0], np.cumsum(LAYOUT.counts[seg, : LAYOUT.n_bones[seg] - 1])])
        b = np.count_nonzero(station > before[1:])
        along = axes.origin[seg, b] + (station - before[b]) / LAYOUT.counts[seg, b] * axes.bone[seg, b]
        out += weight * (along + r * (np.cos(angle) * axes.e1[seg, b] + np.sin(angle) * axes.e2[seg, b]))
    return out


def random_skin(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Segments, shares and coordinates of points that one to three segments hold, all of them in turn."""
    segment = np.full((n, 3), -1)
    share, coords = np.zeros((n, 3)), np.zeros((n, 3, 3))
    for v in range(n):
        held = 1 + v % 3
        segment[v, :held] = [(v + k) % len(SEGMENTS) for k in range(held)]
        share[v, :held] = rng.dirichlet(np.ones(held))
        last = LAYOUT.n_stations[segment[v, :held]] - 1
        coords[v, :held, 0] = rng.uniform(-0.5, last + 0.5)
        coords[v, :held, 1] = rng.uniform(-np.pi, np.pi, held)
        coords[v, :held, 2] = rng.uniform(0.8, 1.2, held)
    return segment, share, coords


def test_points_lie_where_the_slow_twin_puts_them():
    segment, share, coords = random_skin(np.random.default_rng(0), 200)
    out = np.empty((200, 3))
    lay_skin(FIGURE.axes, laying_of(segment, share, coords), FIGURE.table, out)
    want = [laid_slowly(FIGURE.axes, FIGURE.table, *row) for row in zip(segment, share, coords, strict=True)]
    np.testing.assert_allclose(out, want, atol=1e-12)


def test_a_skin_over_wider_radii_encloses_more():
    skin = template("template")
    volumes = [
        enclosed_volume(
            mirrored_vertices(skin, laid_half(FIGURE.axes, FIGURE.table * np.float32(factor), skin)), skin.faces
        )
        for factor in (0.9, 1.0, 1.1)
    ]
    assert volumes[0] < volumes[1] < volumes[2]


@pytest.mark.parametrize("name", ["template", "template_skirt", "template_long_skirt"])
def test_mirrored_halves_equal_those_put_together_by_numpy(name):
    skin = template(name)
    half = np.random.default_rng(1).normal(0, 0.3, (len(skin.on_plane), 3))
    left = half.copy()
    left[:, 1] = np.where(skin.on_plane, 0.0, np.maximum(half[:, 1], LEAST_ASIDE))
    want = np.concatenate([left, left[~skin.on_plane] * (1.0, -1.0, 1.0)])
    np.testing.assert_array_equal(mirrored_vertices(skin, half), want)


def test_evened_displacements_are_half_their_own_and_half_their_neighbours():
    skin = template("template")
    moved = np.random.default_rng(2).normal(0, 0.01, (len(skin.on_plane), 3))
    want = moved
    row = np.repeat(np.arange(len(moved)), np.diff(skin.ring_start))
    for _ in range(3):
        around = np.zeros_like(want)
        np.add.at(around, row, skin.ring_weight[:, None] * want[skin.ring])
        want = 0.5 * want + 0.5 * around
    np.testing.assert_allclose(evened(moved, skin.ring_start, skin.ring, skin.ring_weight, 3), want, atol=1e-15)
