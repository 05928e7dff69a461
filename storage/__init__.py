"""How files are written and kept: whole or absent, and with a digest over what they hold."""
