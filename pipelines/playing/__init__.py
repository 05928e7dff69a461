"""Corpora, folders and recordings played image by image, as a camera would give them."""
