"""Models of every kind: how they are trained, stored, loaded and asked."""
