"""Models of depth sensors, applied to clean depth."""
