"""Measures the model of recorded life on a library of recorded poses, and tells how much of recordings it covers.

    undergrowth import mocap RECORDINGS --distance 0.03 --out fine.lib
    python -m tools.measure_poses fine.lib            # writes synth/bodies/data/life.npz
    undergrowth import mocap RECORDINGS --out poses.lib
    python -m tools.measure_poses fine.lib --coverage poses.lib --folds 4
    python -m tools.measure_poses fine.lib --differences poses.lib --drawn 1500

The coverage is the share of recorded poses that have one of many drawn poses within 8 cm mean joint distance, on one
average body, scale and heading removed. With folds, each trial is judged by a model that was measured without it; all
trials of a fold are left out together. The differences are those between left and right, of recorded and drawn poses.
"""

import argparse
import functools
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from synth.bodies.body import Body
from synth.bodies.life.coverage import nearest_distances, places_of
from synth.bodies.life.model import N_FEET_STATES, POSTURES, LifeModel, Mixture, Posture, vectors_of
from synth.bodies.poses import recorded
from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.poses.families import FAMILIES, Occasion, families_for
from synth.bodies.poses.library import PoseLibrary, read_library
from synth.bodies.poses.recorded import Recorded
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX
from synth.bodies.spec import sample_body
from synth.scene import SceneConfig
from synth.scene.pools import dressed_to_sit

OUT = Path(__file__).resolve().parents[1] / "synth/bodies/data/life.npz"
SOURCE = (
    "CMU Graphics Lab Motion Capture Database: the data used in this project was obtained from mocap.cs.cmu.edu. "
    "The database was created with funding from NSF EIA-0196217."
)
N_COMPONENTS: dict[Posture, int] = {"standing": 56, "sitting": 12}
RANK = 10
LEAST_POSES = 8
"""A component of fewer poses is left out: what is measured is a distribution, not a pose."""
PRIOR_POSES = 25.0
"""A component's covariance is drawn to the mean one by so many poses."""
N_BODIES = 40
CHUNK = 500
"""Draws of a family that one process makes at a time."""
WITHIN = 0.08
Array = NDArray[np.float64]


def fitted(library: PoseLibrary, rows: NDArray[np.int64], n_components: int) -> Mixture:
    """Components: poses whose joints lie near each other, by k-means; each a Gaussian of low rank and noise."""
    vectors = vectors_of(library.angles[rows], library.root[rows])
    places = places_of(library.angles[rows], library.root[rows]).reshape(len(rows), -1)
    label = kmeans2(places, n_components, minit="++", iter=40, rng=np.random.default_rng(0))[1]
    counts = np.bincount(label, minlength=n_components)
    kept = np.flatnonzero(counts >= LEAST_POSES)
    means = np.stack([vectors[label == k].mean(axis=0) for k in kept])
    scatter = [
        (vectors[label == k] - mean).T @ (vectors[label == k] - mean) for k, mean in zip(kept, means, strict=True)
    ]
    pooled = np.sum(scatter, axis=0) / counts[kept].sum()
    state = library.feet[rows].astype(np.int64) @ (3, 1)
    factors, noises, feet = [], [], []
    for k, own in zip(kept, scatter, strict=True):
        covariance = (own + PRIOR_POSES * pooled) / (counts[k] + PRIOR_POSES)
        values, ways = np.linalg.eigh(covariance)
        factor = ways[:, -RANK:] * np.sqrt(np.maximum(values[-RANK:], 0.0))
        factors.append(factor)
        noises.append(np.sqrt(np.maximum(np.diag(covariance) - (factor**2).sum(axis=1), 0.0)))
        feet.append(np.bincount(state[label == k], minlength=N_FEET_STATES) / counts[k])
    # Rare ways to hold oneself are drawn more often than they were recorded: by the root of the count.
    weight = np.sqrt(counts[kept])
    return Mixture(weight / weight.sum(), means, np.stack(factors), np.stack(noises), np.stack(feet))


def measured(library: PoseLibrary, is_used: NDArray[np.bool_]) -> LifeModel:
    """The model of some of a library's poses."""
    rows = {p: np.flatnonzero(is_used & (library.is_sitting == (p == "sitting"))) for p in POSTURES}
    mixtures = {p: fitted(library, rows[p], N_COMPONENTS[p]) for p in POSTURES}
    return LifeModel(mixtures, SOURCE, {p: len(rows[p]) for p in POSTURES})


def write(model: LifeModel, n_trials: int, n_subjects: int, path: Path) -> None:
    """Writes a model's numbers, rounded."""
    arrays = {
        f"{posture}_{name}": np.round(values, 4).astype(np.float32)
        for posture, mixture in model.mixtures.items()
        for name, values in zip(Mixture._fields, mixture, strict=True)
    }
    about = {"source": model.source, "n_poses": model.n_poses, "n_trials": n_trials, "n_subjects": n_subjects}
    np.savez_compressed(path, about=np.array(json.dumps(about)), **arrays)  # type: ignore[arg-type]
    kb = path.stat().st_size / 1024
    print(f"{path.name}: {model.n_poses} poses, {n_trials} trials, {n_subjects} people, {kb:.0f} kB")


def shares_of(posture: Posture, occasions: dict[Occasion, float]) -> dict[str, float]:
    """Share of each family without context among draws of a posture; occasions without families are left out."""
    groups = {name: families_for(posture, "none", name) for name in occasions}
    total = sum(share for name, share in occasions.items() if groups[name])
    return {
        kind.name: occasions[name] / total * kind.weight / sum(other.weight for other in kinds)
        for name, kinds in groups.items()
        for kind in kinds
    }


def drawn(shares: dict[str, float], n: int, model: LifeModel | None, n_processes: int) -> tuple[Array, Array]:
    """(m, n_dofs) angles and (m, 3, 3) roots of about n poses, of each family its share, drawn as scenes draw them.

    A family's draws are the same whatever the other families, and fewer are the first of more.
    """
    tasks = [
        (name, chunk, min(CHUNK, round(n * share) - chunk * CHUNK), model if is_recorded(name) else None)
        for name, share in shares.items()
        for chunk in range(-(-round(n * share) // CHUNK))
    ]
    with ProcessPoolExecutor(n_processes) as pool:
        parts = list(pool.map(_draw_chunk, *zip(*tasks, strict=True)))
    return np.concatenate([angles for angles, _ in parts]), np.concatenate([roots for _, roots in parts])


def is_recorded(name: str) -> bool:
    """Whether a family is drawn from the model of recorded life."""
    return isinstance(FAMILIES[name].base, Recorded)


def _draw_chunk(name: str, chunk: int, n: int, model: LifeModel | None) -> tuple[Array, Array]:
    """Draws some poses of a family; with a model, from that instead of the shipped one."""
    if model is not None:
        recorded.life_model = lambda: model
    rng = np.random.default_rng([list(FAMILIES).index(name), chunk])
    bodies, angles, roots = sampled_bodies(), [], []
    while len(angles) < n:
        body = bodies[int(rng.integers(len(bodies)))]
        pose = draw_arms(name, body, draw_base(name, body, rng), rng)
        if pose is not None:
            angles.append(pose.angles)
            roots.append(pose.T_world_root[:3, :3])
    return np.array(angles), np.array(roots)


@functools.cache
def sampled_bodies() -> list[Body]:
    """People as corpora have them, in trousers."""
    specs = [sample_body(np.random.default_rng([k, 3])) for k in range(N_BODIES)]
    return [make_body(dressed_to_sit(spec)) for spec in specs]


def default_shares() -> dict[Occasion, float]:
    """Shares of the occasions in the default scenes; who sits does not exercise."""
    scene = SceneConfig()
    others = 1.0 - scene.exercising_share
    return {
        "daily": others * (1.0 - scene.life_share),
        "exercise": scene.exercising_share,
        "life": others * scene.life_share,
    }


def _wilson(share: float, n: int) -> tuple[float, float]:
    z, p = 1.96, share
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def tell_coverage(
    fine: PoseLibrary,
    judged: PoseLibrary,
    n_folds: int,
    n_drawn: int,
    n_processes: int,
    postures: Sequence[Posture],
) -> None:
    """Prints the coverage by posture and trial, before (daily families) and after (the default scenes)."""
    names = sorted({trial.name for trial in judged.trials})
    folds = [names[k::n_folds] for k in range(n_folds)]
    of_pose = np.array([trial.name for trial in judged.trials])[judged.trial]
    of_fine = np.array([trial.name for trial in fine.trials])[fine.trial]
    models = [measured(fine, ~np.isin(of_fine, fold)) for fold in folds]
    asked = places_of(judged.angles, judged.root)
    before, after = np.full(len(judged), np.inf, np.float32), np.full(len(judged), np.inf, np.float32)
    print(f"poses with one of {n_drawn} drawn within {100 * WITHIN:g} cm [%], before and after")
    for posture in postures:
        is_of = judged.is_sitting == (posture == "sitting")
        daily, shares = shares_of(posture, {"daily": 1.0}), shares_of(posture, default_shares())
        before[is_of] = nearest_distances(asked[is_of], places_of(*drawn(daily, n_drawn, None, n_processes)))
        fixed = {name: share for name, share in shares.items() if not is_recorded(name)}
        known = places_of(*drawn(fixed, n_drawn, None, n_processes))
        after[is_of] = nearest_distances(asked[is_of], known)
        own = {name: share for name, share in shares.items() if is_recorded(name)}
        for fold, model in zip(folds, models, strict=True):
            is_left_out = is_of & np.isin(of_pose, fold)
            if is_left_out.any():
                poses = places_of(*drawn(own, n_drawn, model, n_processes))
                after[is_left_out] = np.minimum(after[is_left_out], nearest_distances(asked[is_left_out], poses))
        _tell(posture, before[is_of], after[is_of])
    is_told = np.isfinite(after)
    for name in names:
        if (is_of := is_told & (of_pose == name)).any():
            _tell(name, before[is_of], after[is_of])


def _tell(name: str, before: NDArray[np.float32], after: NDArray[np.float32]) -> None:
    words = []
    for distances in (before, after):
        share = float((distances <= WITHIN).mean())
        low, high = _wilson(share, len(distances))
        words.append(
            f"{100 * share:5.1f} [{100 * low:.1f}, {100 * high:.1f}] median {100 * np.median(distances):.1f} cm"
        )
    print(f"{name:10} {len(before):5} {words[0]:40} {words[1]}", flush=True)


def tell_differences(judged: PoseLibrary, n_drawn: int, n_processes: int) -> None:
    """Prints how much left and right differ in recordings and in drawn poses: 95 % quantiles [degrees]."""
    names = ("hip_flexion", "hip_abduction", "knee_flexion", "shoulder_flexion", "elbow_flexion")
    print(f"95 % quantile of |left - right| [degrees]: {', '.join(names)}; of the greater knee flexion")
    for posture in POSTURES:
        sets = {"recorded": judged.angles[judged.is_sitting == (posture == "sitting")]}
        daily, default = shares_of(posture, {"daily": 1.0}), shares_of(posture, default_shares())
        sets["daily families"] = drawn(daily, n_drawn, None, n_processes)[0]
        sets["default scenes"] = drawn(default, n_drawn, None, n_processes)[0]
        for title, angles in sets.items():
            left, right = (np.degrees(angles[:, [DOF_IDX[f"{s}_{n}"] for n in names]]) for s in "lr")
            apart = np.quantile(np.abs(left - right), 0.95, axis=0)
            knee = np.quantile(np.maximum(left, right)[:, 2], 0.95)
            print(f"{posture:9} {title:15} {' '.join(f'{value:5.0f}' for value in apart)}  {knee:5.0f}")


def main() -> None:
    """Measures the model, or tells its coverage."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library", type=Path, help="poses to measure on")
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--coverage", type=Path, help="tell the coverage of these poses instead")
    parser.add_argument("--differences", type=Path, help="tell how left and right differ instead")
    parser.add_argument("--folds", type=int, default=4)
    parser.add_argument("--drawn", type=int, default=20000)
    parser.add_argument("--postures", nargs="+", choices=POSTURES, default=POSTURES)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    library = read_library(options.library)
    if options.differences is not None:
        tell_differences(read_library(options.differences), options.drawn, options.processes)
        return
    if options.coverage is None:
        model = measured(library, np.ones(len(library), np.bool_))
        write(model, len(library.trials), len({trial.subject for trial in library.trials}), options.out)
        return
    judged = read_library(options.coverage)
    tell_coverage(library, judged, options.folds, options.drawn, options.processes, options.postures)


if __name__ == "__main__":
    main()
