"""Finds people and the floor in the depth image of a whole scene."""
