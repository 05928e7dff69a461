"""Whole scenes: rooms with their furniture, several people in groups, and a camera among them."""
