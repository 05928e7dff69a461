"""Where data lies that is not in the repository: tests that need it skip where it is absent."""

from pathlib import Path

SHARED = Path(__file__).resolve().parents[2] / "shared"
