"""A corpus as a map-style torch Dataset; numpy arrays where torch is not installed."""

from typing import Any

import numpy as np

from pipelines.corpus import Corpus

DEFAULT_FIELDS = ("depth", "part", "occluder", "joints", "joint_state")


def torch_dataset(
    corpus: Corpus,
    split: str | None = None,
    fields: tuple[str, ...] = DEFAULT_FIELDS,
    sensor: str | None = None,
) -> "CorpusDataset":
    """A dataset for `torch.utils.data.DataLoader`.

    Args:
        corpus: An open corpus.
        split: "train", "val" or "test"; all frames if None.
        fields: Array names of `Corpus.array_names`.
        sensor: Sensor model for "depth", or None for clean depth.

    Returns:
        Items are dicts by field name, with "index" the frame's number. Torch tensors if torch is installed, numpy
        arrays if not; depth comes as float32 metres, codes as int64, so that losses take them.
    """
    return CorpusDataset(corpus, corpus.indices if split is None else corpus.split(split), fields, sensor)


class CorpusDataset:
    """The frames of a corpus by position; picklable for DataLoader's workers."""

    def __init__(
        self, corpus: Corpus, indices: np.ndarray, fields: tuple[str, ...], sensor: str | None = None
    ) -> None:
        self.corpus = corpus
        self.indices = indices
        self.fields = fields
        self.sensor = sensor

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, position: int) -> dict[str, Any]:
        """The frame at that place of the split."""
        index = int(self.indices[position])
        item: dict[str, Any] = {"index": index}
        for name in self.fields:
            sensor = self.sensor if name == "depth" else None
            item[name] = _as_tensor(_plain(name, self.corpus.arrays(name, [index], sensor)[0]))
        return item


def _plain(name: str, value: np.ndarray) -> np.ndarray:
    """Depth as float32 metres, codes as int64, the rest as it is."""
    if name in ("depth", "body_depth"):
        return value * np.float32(0.001)
    return value.astype(np.int64) if value.dtype == np.uint8 else value


def _as_tensor(value: np.ndarray) -> Any:
    try:
        import torch
    except ImportError:
        return value
    return torch.from_numpy(np.ascontiguousarray(value))
