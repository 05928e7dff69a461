"""Solids that stand for objects: distances to points, and how far they may move."""
