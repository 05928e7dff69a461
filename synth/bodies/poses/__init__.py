"""Poses: the families, how each is drawn, and libraries of captured ones."""
