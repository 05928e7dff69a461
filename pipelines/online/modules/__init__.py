"""Modules: each analyses one thing about a person, in a process of its own or in that of the system."""
