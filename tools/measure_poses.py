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
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from synth.bodies.body import Body
from synth.bodies.life import model as life
from synth.bodies.life.coverage import nearest_distances, places_of
from synth.bodies.life.model import N_FEET_STATES, POSTURES, LifeModel, Mixture, Posture, vectors_of
from synth.bodies.poses import recorded
from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.poses.families import Occasion, PoseFamily, families_for
from synth.bodies.poses.library import PoseLibrary, read_library
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


def drawn(
    groups: list[tuple[float, list[PoseFamily]]], bodies: list[Body], n: int, seed: int
) -> tuple[Array, Array]:
    """(n, n_dofs) angles and (n, 3, 3) roots of poses drawn as scenes draw them, by share and weight of families."""
    rng = np.random.default_rng(seed)
    shares = np.array([share for share, _ in groups])
    angles, roots = [], []
    while len(angles) < n:
        kinds = groups[int(rng.choice(len(groups), p=shares / shares.sum()))][1]
        weights = np.array([kind.weight for kind in kinds])
        kind = kinds[int(rng.choice(len(kinds), p=weights / weights.sum()))]
        body = bodies[int(rng.integers(len(bodies)))]
        pose = draw_arms(kind, body, draw_base(kind, body, rng), rng)
        if pose is not None:
            angles.append(pose.angles)
            roots.append(pose.T_world_root[:3, :3])
    return np.array(angles), np.array(roots)


def sampled_bodies() -> list[Body]:
    """People as corpora have them, in trousers."""
    specs = [sample_body(np.random.default_rng([k, 3])) for k in range(N_BODIES)]
    return [make_body(dressed_to_sit(spec)) for spec in specs]


def groups_of(posture: Posture, shares: dict[Occasion, float]) -> list[tuple[float, list[PoseFamily]]]:
    """Families without context by occasion; the weights of those there are."""
    return [
        (share, kinds)
        for name, share in shares.items()
        if (kinds := families_for(posture, "none", name)) and share
    ]


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


def tell_coverage(fine: PoseLibrary, judged: PoseLibrary, n_folds: int, n_drawn: int) -> None:
    """Prints the coverage by posture and trial, before (daily families) and after (with the model of life)."""
    bodies = sampled_bodies()
    asked = places_of(judged.angles, judged.root)
    names = sorted({trial.name for trial in judged.trials})
    folds = [set(names[k::n_folds]) for k in range(n_folds)]
    of_pose = np.array([trial.name for trial in judged.trials])[judged.trial]
    of_fine = np.array([trial.name for trial in fine.trials])[fine.trial]
    after = np.empty(len(judged), np.float32)
    before = np.empty(len(judged), np.float32)
    for posture in POSTURES:
        is_of = judged.is_sitting == (posture == "sitting")
        daily = drawn(groups_of(posture, {"daily": 1.0}), bodies, n_drawn, 1)
        before[is_of] = nearest_distances(asked[is_of], places_of(*daily))
    for k, fold in enumerate(folds):
        model = measured(fine, ~np.isin(of_fine, list(fold)))
        recorded.life_model = life.life_model = lambda model=model: model
        for posture in POSTURES:
            is_of = (judged.is_sitting == (posture == "sitting")) & np.isin(of_pose, list(fold))
            if is_of.any():
                ours = drawn(
                    groups_of(posture, {"daily": 0.35, "exercise": 0.15, "life": 0.5}), bodies, n_drawn, 2
                )
                after[is_of] = nearest_distances(asked[is_of], places_of(*ours))
        print(f"fold {k + 1}: {', '.join(sorted(fold))}", flush=True)
    print(f"poses with one of {n_drawn} drawn within {100 * WITHIN:g} cm [%], before and after")
    for posture in POSTURES:
        is_of = judged.is_sitting == (posture == "sitting")
        _tell(posture, before[is_of], after[is_of])
    for name in names:
        _tell(name, before[of_pose == name], after[of_pose == name])


def _tell(name: str, before: NDArray[np.float32], after: NDArray[np.float32]) -> None:
    words = []
    for distances in (before, after):
        share = float((distances <= WITHIN).mean())
        low, high = _wilson(share, len(distances))
        words.append(
            f"{100 * share:5.1f} [{100 * low:.1f}, {100 * high:.1f}] median {100 * np.median(distances):.1f} cm"
        )
    print(f"{name:10} {len(before):5} {words[0]:40} {words[1]}")


def tell_differences(judged: PoseLibrary, n_drawn: int) -> None:
    """Prints how much left and right differ in recordings and in drawn poses: 95 % quantiles [degrees]."""
    names = ("hip_flexion", "hip_abduction", "knee_flexion", "shoulder_flexion", "elbow_flexion")
    bodies = sampled_bodies()
    print(f"95 % quantile of |left - right| [degrees]: {', '.join(names)}; of the greater knee flexion")
    for posture in POSTURES:
        sets = {"recorded": judged.angles[judged.is_sitting == (posture == "sitting")]}
        sets["daily families"] = drawn(groups_of(posture, {"daily": 1.0}), bodies, n_drawn, 1)[0]
        sets["default scenes"] = drawn(groups_of(posture, default_shares()), bodies, n_drawn, 2)[0]
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
    options = parser.parse_args()
    library = read_library(options.library)
    if options.differences is not None:
        tell_differences(read_library(options.differences), options.drawn)
        return
    if options.coverage is None:
        model = measured(library, np.ones(len(library), np.bool_))
        write(model, len(library.trials), len({trial.subject for trial in library.trials}), options.out)
        return
    tell_coverage(library, read_library(options.coverage), options.folds, options.drawn)


if __name__ == "__main__":
    main()
