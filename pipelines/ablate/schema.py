"""What ablation.json is called, and which version of it this program writes and reads."""

from collections.abc import Mapping

DOCUMENT_NAME = "ablation.json"
SCHEMA = "undergrowth ablation"
SCHEMA_VERSION = 1
PAPER_MAP_10CM: Mapping[str, float] = {"baseline": 0.44, "occluders": 0.48, "semantic": 0.54}
"""Rafi et al. 2015, table 1."""
