"""No kernel reads or writes beyond an array: what numba leaves unchecked is checked here, on tiny inputs."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_kernels_stay_within_their_arrays(tmp_path):
    """In a process of its own, as numba compiles the checks in or leaves them out for all of one."""
    settings = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_OPT": "1"}
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("boundscheck_kernels.py"))],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | settings | {"PYTHONPATH": paths},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [
        "predict",
        "predict_told",
        "walk",
        "render",
        "nearest",
        "spread",
        "body",
        "find",
        "read_out_of_range",
    ]
