"""A server of S3 on loopback for tests, with the environment that clients find it by."""

import contextlib
import os

import pytest

BUCKET = "undergrowth"


@contextlib.contextmanager
def s3_server(cache):
    """Runs moto's server; gives the URL of an empty bucket there."""
    pytest.importorskip("s3fs", reason="undergrowth[remote] is not installed")
    server_of = pytest.importorskip("moto.server", reason="moto is not installed")
    import s3fs

    server = server_of.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    environment = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
        "UNDERGROWTH_CACHE": str(cache),
    }
    before = {name: os.environ.get(name) for name in environment}
    os.environ.update(environment)
    s3fs.S3FileSystem.clear_instance_cache()  # which keeps clients of an earlier server
    bucket = f"{BUCKET}-{port}"  # all servers of a process share their buckets
    try:
        s3fs.S3FileSystem().mkdir(bucket)
        yield f"s3://{bucket}"
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.__setitem__(name, value)
        server.stop()
        s3fs.S3FileSystem.clear_instance_cache()
