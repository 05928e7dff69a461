"""Motion capture: reads BVH files and carries their poses over to our skeleton."""
