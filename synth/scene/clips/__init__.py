"""Clips: people who walk, stand, gesture and sit in a room, over time."""
