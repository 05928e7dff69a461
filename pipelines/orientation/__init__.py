"""Which way people face: the truth of a corpus, and nets that are trained on it, asked and scored."""
