"""Workers for the tests of clusters: two, started once."""

import contextlib
import warnings

import pytest

pytest.importorskip("distributed", reason="undergrowth[cluster] is not installed")

from s3_server import s3_server

from pipelines.engine.cluster import open_cluster


@pytest.fixture(scope="session")
def bucket(tmp_path_factory):
    """URL of a bucket that the workers know too, or None where its server is not installed."""
    with contextlib.ExitStack() as stack:
        try:
            yield stack.enter_context(s3_server(tmp_path_factory.mktemp("cache")))
        except pytest.skip.Exception:
            yield None


@pytest.fixture(scope="session")
def cluster(bucket):
    """Two workers of this machine."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with open_cluster("local:2") as opened:
            yield opened
