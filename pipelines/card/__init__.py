"""Model cards: what a model learned from, how well it finds joints, and what it cannot do."""
