"""Makes labelled depth frames of people among furniture from a seed."""
