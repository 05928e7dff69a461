"""Drawn objects among recorded people: the recorded corpus, its floor, and what becomes of its frames."""
