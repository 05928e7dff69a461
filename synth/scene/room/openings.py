"""Draws the doors and windows of a room."""

import numpy as np

from synth.scene.room.spec import N_WALLS, Opening, RoomSpec

TRIES = 12
"""Places tried for one opening before the wall does without it."""


def draw_openings(spec: RoomSpec, rng: np.random.Generator) -> tuple[Opening, ...]:
    """Doors of 0.8-1.0 m by 2.0-2.1 m (twice as wide in halls), windows with sills of 0.75-1.0 m; sizes are common."""
    walls = [k for k in range(N_WALLS) if spec.walls[k]]
    openings: list[Opening] = []
    n_doors = int(rng.integers(1, 3)) if walls else 0
    for _ in range(n_doors):
        wide = float(rng.uniform(0.8, 1.0)) * (2.0 if spec.kind == "hall" else 1.0)
        filling = "open" if rng.random() < 0.4 else "leaf"
        top = min(float(rng.uniform(2.0, 2.1)), spec.height - 0.1)
        _add_opening(spec, openings, walls[int(rng.integers(len(walls)))], wide, (0.0, top), filling, rng)
    if not walls:
        return ()
    lit = walls[int(rng.integers(len(walls)))]
    n_windows = int(rng.integers(1, {"living": 3, "office": 4, "hall": 5}[spec.kind]))
    for _ in range(n_windows):
        sill = float(rng.uniform(0.75, 1.0)) if rng.random() < 0.85 else float(rng.uniform(0.02, 0.1))
        top = min(float(rng.uniform(2.05, 2.3)), spec.height - 0.12)
        if top - sill >= 0.6:
            _add_opening(spec, openings, lit, float(rng.uniform(0.8, 2.0)), (sill, top), "glass", rng)
    return tuple(openings)


def _add_opening(
    spec: RoomSpec,
    openings: list[Opening],
    wall: int,
    width: float,
    z: tuple[float, float],
    filling: str,
    rng: np.random.Generator,
) -> None:
    """Adds an opening to the list if the wall has room for it between those that it has."""
    half = spec.wall_length(wall) / 2 - width / 2 - 0.15
    for _ in range(TRIES if half > 0.0 else 0):
        at = float(rng.uniform(-half, half))
        others = [item for item in openings if item.wall == wall]
        if all(abs(at - item.at) > (width + item.width) / 2 + 0.25 for item in others):
            openings.append(Opening(wall, round(at, 3), round(width, 3), round(z[0], 3), round(z[1], 3), filling))
            return
