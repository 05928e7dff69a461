"""Generates and trains on the workers of a Dask scheduler: the tasks, and the check that workers are alike."""
