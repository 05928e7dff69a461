"""Turns posed meshes into depth, labels and sensor readings."""
