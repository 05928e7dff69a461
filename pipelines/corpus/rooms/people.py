"""Arrays of people, one row a person, from corpora of both schemas."""

import numpy as np

from pipelines.corpus.fields import OF_PEOPLE
from pipelines.corpus.read import Corpus
from synth.vocabulary import MAX_PEOPLE


def by_person(corpus: Corpus, name: str) -> np.ndarray:
    """One field of every person of every frame.

    Args:
        corpus: An open corpus.
        name: A field of people, or one of frames, whose rows are then repeated for each of their people.

    Returns:
        (n_people, ...) by frame, then by number.
    """
    values = corpus.arrays(name)
    if not corpus.header.has_rooms:
        return values
    is_used = np.arange(MAX_PEOPLE) < corpus.arrays("n_people")[:, None]
    if name in OF_PEOPLE or name == "box":
        return np.asarray(values[is_used])
    return np.repeat(values, is_used.sum(axis=1), axis=0)
