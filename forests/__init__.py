"""Learns joints from depth arrays; knows nothing of synth."""
