"""Procedural furniture and things that stand on it, one kind a file."""
