"""Puts the toy source on the path of tests and of the worker processes they start."""

import functools
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from toy_source import ToySource

from pipelines.corpus import Corpus, Order, write_corpus


def toy_order(n_frames=200, seed=3, **settings):
    """An order for toy frames."""
    make = functools.partial(ToySource, seed, n_frames, **settings)
    return Order(seed, n_frames, {"toy": True, "pause": 0}, make)


@pytest.fixture(scope="session")
def order():
    """Makes orders for toy frames."""
    return toy_order


@pytest.fixture(scope="session")
def toy_corpus(tmp_path_factory):
    """A finished corpus of 200 toy frames; read only."""
    root = tmp_path_factory.mktemp("corpus") / "toy"
    write_corpus(root, toy_order())
    return Corpus.open(root)


def files_of(root):
    """Bytes of every file under a folder by relative path."""
    return {str(path.relative_to(root)): path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file()}


@pytest.fixture(scope="session")
def bytes_of():
    """Reads every file of a folder."""
    return files_of
