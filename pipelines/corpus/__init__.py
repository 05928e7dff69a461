"""Corpora on disk: written shard by shard, resumable to the byte, read back as frames or arrays."""

from pipelines.corpus.folder import Order
from pipelines.corpus.header import ROOM_SCHEMA_VERSION, SCHEMA_VERSION, Header
from pipelines.corpus.read import Corpus
from pipelines.corpus.run import write_corpus

__all__ = ["ROOM_SCHEMA_VERSION", "SCHEMA_VERSION", "Corpus", "Header", "Order", "write_corpus"]
