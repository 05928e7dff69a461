"""Corpora at URLs: shards are put whole and the manifest last; what is read is kept in a folder of this machine."""
