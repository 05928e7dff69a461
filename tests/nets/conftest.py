"""Puts the toy patches on the path of tests."""

import sys
from pathlib import Path

for folder in (".", "orientation"):
    sys.path.insert(0, str(Path(__file__).parent / folder))
