"""What a body looks like: measures, the skin laid over them, clothes and hair."""
