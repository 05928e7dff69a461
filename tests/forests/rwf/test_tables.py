"""Packed trees are the trees: the same shape, numbers rounded to their units, what is read together side by side."""

import numpy as np
import pytest

from forests.rwf.model import ExpertTree
from forests.rwf.tables import PACKED_DTYPE, WEIGHT_ONE, WalkTables, pack_experts, walk_tables
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE


def tables_of(grown) -> WalkTables:
    return walk_tables(pack_experts(grown))


def lopsided_tree(rng: np.random.Generator, n_leaves: int, n_clusters=3) -> ExpertTree:
    """A tree that grew where it happened to, breadth first."""
    nodes = np.zeros(2 * n_leaves - 1, NODE_DTYPE)
    nodes["left"], nodes["leaf"], nodes["threshold"] = np.arange(len(nodes)), 0, LEAF_THRESHOLD
    n = 1
    for node in range(len(nodes)):
        is_last_end = node == n - 1
        if n < len(nodes) and (is_last_end or rng.random() < 0.6):
            nodes["left"][node], nodes["leaf"][node] = n, -1
            nodes["threshold"][node] = rng.integers(-3000, 3000)
            nodes["u"][node], nodes["v"][node] = rng.uniform(-0.5, 0.5, (2, 2))
            n += 2
    is_leaf = nodes["leaf"] >= 0
    nodes["leaf"][is_leaf] = np.arange(n_leaves)
    share = rng.dirichlet(np.ones(n_clusters), n_leaves)
    values = rng.normal(0, 0.3, (n_leaves, n_clusters, 3)), share, rng.uniform(0, 0.2, share.shape)
    return ExpertTree(nodes, *(each.astype(np.float32) for each in values))


@pytest.mark.parametrize("n_leaves", [1, 2, 3, 60])
def test_packed_trees_decide_as_the_trees_do(n_leaves):
    rng = np.random.default_rng(n_leaves)
    experts = tuple(tuple(lopsided_tree(rng, n_leaves) for _ in range(2)) for _ in range(2))
    tables = tables_of(experts)
    seen = set()
    for joint, trees in enumerate(experts):
        for number, tree in enumerate(trees):
            waiting = [(0, int(tables.root[joint, number]))]
            while waiting:
                node, place = waiting.pop()
                seen.add(place)
                own, packed = tree.nodes[node], tables.nodes[place]
                if own["leaf"] >= 0:
                    votes = tables.vote[-1 - packed["next"]]
                    offset = votes[:, :3] * tables.offset_m
                    np.testing.assert_allclose(offset, tree.offset[own["leaf"]], atol=0.51 * tables.offset_m)
                    weight = tree.share[own["leaf"]] * (0.1 / (0.1 + tree.spread[own["leaf"]])) ** 3
                    np.testing.assert_allclose(votes[:, 3] / WEIGHT_ONE, weight, atol=1 / WEIGHT_ONE)
                    continue
                for name in ("u", "v"):
                    np.testing.assert_allclose(
                        packed[name] * tables.probe_m, own[name], atol=0.51 * tables.probe_m
                    )
                assert packed["threshold"] == np.clip(own["threshold"], -2001, 2000)
                assert packed["next"] % 2 == 0, "a pair of children lies in one line of the cache"
                waiting += [(own["left"] + side, packed["next"] + side) for side in (0, 1)]
    assert len(seen) == 4 * (2 * n_leaves - 1)


def test_tables_are_small_and_start_where_a_line_of_the_cache_does():
    tables = tables_of(((lopsided_tree(np.random.default_rng(0), 40),),))
    assert PACKED_DTYPE.itemsize == 16
    assert tables.nodes.ctypes.data % 64 == tables.vote.ctypes.data % 64 == 0


def test_a_cluster_that_is_there_always_votes():
    tree = lopsided_tree(np.random.default_rng(0), 4)
    tree.share[:] = (1.0, 1e-7, 0.0)
    np.testing.assert_array_equal(tables_of(((tree,),)).vote[:, 1:, 3], np.tile([1, 0], (4, 1)))
