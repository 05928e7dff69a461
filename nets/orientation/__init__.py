"""Which way bodies and heads face, after Beyer et al. 2015, Biternion Nets."""
