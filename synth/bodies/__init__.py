"""Articulated human bodies: shape, skin, skeleton, poses, URDF."""
