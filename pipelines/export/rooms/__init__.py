"""Exports of whole scenes: the formats of frames with one person, each with what several people add."""
