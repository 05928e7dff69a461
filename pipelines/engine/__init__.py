"""Runs tasks somewhere else: in processes of this machine, or on the workers of a Dask scheduler."""
