"""What rooms cost: the answers of the ablation's question `rooms`, with 95 % intervals from resamples of the scenes.

undergrowth ablate --size demo --config examples/ablate/rooms.toml --out out/ablate_rooms
python benchmarks/score_rooms.py out/ablate_rooms --config examples/ablate/rooms.toml
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from forests.calibration import WITHIN_M  # noqa: E402
from pipelines.ablate.config import load_config  # noqa: E402
from pipelines.ablate.folder import ResultsFolder  # noqa: E402
from pipelines.ablate.plan import make_plan  # noqa: E402
from pipelines.metrics import errors  # noqa: E402
from pipelines.metrics.resampling import N_RESAMPLES, Ratio, draw_together  # noqa: E402
from pipelines.metrics.results import read_results  # noqa: E402
from synth.vocabulary import MAX_PEOPLE, JointState  # noqa: E402


class Shares:
    """Shares of joints in percent, with intervals; scenes are drawn anew, since people of one scene are alike."""

    def __init__(self, truths):
        self.scene = truths.frame // MAX_PEOPLE
        self.weights = draw_together(self.scene, N_RESAMPLES, np.random.default_rng(0))

    def of(self, values, is_counted):
        """The mean of values (n, n_joints) over the joints that count, and its interval."""
        top, bottom = (values * is_counted).sum(axis=1), is_counted.sum(axis=1).astype(float)
        low, high = np.percentile(Ratio(top, bottom)(self.weights), [2.5, 97.5])
        return f"{100 * top.sum() / bottom.sum():5.1f} [{100 * low:.1f}, {100 * high:.1f}]"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--config", type=Path, required=True)
    parser.add_argument("--size", default="demo")
    options = parser.parse_args()
    folder = ResultsFolder(options.folder)
    plan = make_plan(load_config(options.size, options.config))
    conditions = [condition for condition in plan.conditions if condition.question == "rooms"]
    answers = {
        (condition.settings, row): read_results(folder.rows(condition.of_row(row)[0]))[0][0]
        for condition in conditions
        for row in condition.rows
    }
    truths = next(iter(answers.values())).truths
    shares = Shares(truths)
    everything = np.ones(truths.state.shape, bool)
    groups = {"visible": truths.state == JointState.VISIBLE, "hidden": truths.state == JointState.OCCLUDED}
    print(f"{len(truths)} people in {len(np.unique(shares.scene))} frames")
    for condition in conditions:
        print(", ".join(f"{name}: {value}" for name, value in condition.settings))
        for row in condition.rows:
            results = answers[condition.settings, row]
            is_near = (np.nan_to_num(errors(results), nan=np.inf) <= WITHIN_M).astype(float)
            reference = answers[conditions[0].settings, row]
            gain = is_near - (np.nan_to_num(errors(reference), nan=np.inf) <= WITHIN_M)
            is_found = np.isfinite(results.proposals[:, :, 0]).any(axis=(1, 2))
            words = f"  {row:10} {shares.of(is_near, everything)}; gain {shares.of(gain, everything)}"
            words += f"; of {is_found.sum()} found {shares.of(gain, everything * is_found[:, None])}"
            print(words + "".join(f"; {name} {shares.of(is_near, joints)}" for name, joints in groups.items()))


if __name__ == "__main__":
    main()
