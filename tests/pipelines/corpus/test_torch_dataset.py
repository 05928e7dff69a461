"""A corpus as a dataset: with torch if it is there, as numpy arrays if not."""

import pickle
import sys
import types

import numpy as np

from pipelines.corpus.torch_dataset import torch_dataset


def test_without_torch_items_are_numpy_arrays(toy_corpus, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    dataset = torch_dataset(toy_corpus, "val")
    numbers = toy_corpus.split("val")
    assert len(dataset) == len(numbers)
    item, frame = dataset[2], toy_corpus[int(numbers[2])]
    assert item["index"] == numbers[2]
    assert item["depth"].dtype == np.float32
    np.testing.assert_allclose(item["depth"], frame.depth / 1000, rtol=1e-6)
    assert item["part"].dtype == np.int64
    np.testing.assert_array_equal(item["joints"], frame.joints)


def test_with_torch_items_are_tensors(toy_corpus, monkeypatch):
    try:
        import torch
    except ImportError:
        torch = types.SimpleNamespace(from_numpy=lambda array: ("tensor", array))
        monkeypatch.setitem(sys.modules, "torch", torch)
        item = torch_dataset(toy_corpus)[5]
        assert item["part"][0] == "tensor"
        return
    (batch,) = torch.utils.data.DataLoader(torch_dataset(toy_corpus, "val"), batch_size=30)
    assert batch["depth"].shape == (30, 48, 64)


def test_a_dataset_travels_to_another_process(toy_corpus, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    dataset = pickle.loads(pickle.dumps(torch_dataset(toy_corpus, fields=("joints",))))
    np.testing.assert_array_equal(dataset[7]["joints"], toy_corpus[7].joints)
