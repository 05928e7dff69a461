"""Puts synth and forests to work: corpora on disk, commands."""
