"""Workers for the tests of clusters: two, started once."""

import warnings

import pytest

pytest.importorskip("distributed", reason="undergrowth[cluster] is not installed")

from pipelines.engine.cluster import open_cluster


@pytest.fixture(scope="session")
def cluster():
    """Two workers of this machine."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with open_cluster("local:2") as opened:
            yield opened
