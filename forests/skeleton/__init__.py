"""One skeleton out of many proposals: what bodies are like, learned answers for all joints at once, exact decoding."""
