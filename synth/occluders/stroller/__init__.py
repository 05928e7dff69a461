"""Strollers in three builds: umbrella, pram, three-wheeler."""
