"""What cards of every model tell: what it learned from, and the templates that say it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from forests.modelfile import read_model
from pipelines.corpus.read import Corpus
from pipelines.errors import UserError


class Source(NamedTuple):
    """A corpus as a card tells of it.

    Attributes:
        name: Of its folder.
        digest: The beginning of its digest.
        n_frames: Frames of the whole corpus.
        made: How, in words.
        is_recorded: Whether a real camera measured its people.
        is_learned: Whether the model was trained on it.
    """

    name: str
    digest: str
    n_frames: int
    made: str
    is_recorded: bool
    is_learned: bool


def check_told(model: Path) -> tuple[dict[str, Any], list[str]]:
    """What a model's file tells beside its arrays, and the digests of the corpora that it was trained on.

    Raises:
        UserError: It does not say what it was trained on.
    """
    told = read_model(model).metadata
    if not {"corpus", "n_frames", "sensor", "software"} <= set(told):
        raise UserError(f"{model} does not say what it was trained on; models of `undergrowth train` do")
    return told, told["corpus"] if isinstance(told["corpus"], list) else [told["corpus"]]


def sources_told(sources: Sequence[Source], learned: Sequence[str], corpora: Sequence[Corpus]) -> dict[str, Any]:
    """What templates tell of corpora.

    Args:
        sources: Corpora at hand.
        learned: Digests of those that the model was trained on.
        corpora: Corpora at hand.
    """
    n_untold = len(set(learned) - {corpus.digest for corpus in corpora})
    return {
        "sources": sources,
        "n_untold": n_untold,
        "has_generated": n_untold > 0 or any(one.is_learned and not one.is_recorded for one in sources),
        "has_recordings": any(source.is_recorded and source.is_learned for source in sources),
    }


def template(name: str) -> Template:
    """A template of this package."""
    environment = Environment(
        loader=PackageLoader("pipelines.card"),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(name)


def source_of(corpus: Corpus, is_learned: bool) -> Source:
    """A corpus as a card tells of it."""
    config = corpus.header.config
    is_recorded = corpus.header.is_recorded
    if is_recorded:
        made = "recorded by a depth camera" + (", objects put before the people" if "into" in config else "")
    else:
        camera = config.get("scene", {}).get("camera", "of another source")
        made = f"generated for the camera {camera}, seed {corpus.header.seed}"
        extra = [
            word for word, key in (("recorded poses", "poses"), ("imported objects", "objects")) if key in config
        ]
        made += f", with {' and '.join(extra)}" if extra else ""
    return Source(
        corpus.path.resolve().name, corpus.digest[:12], corpus.header.n_frames, made, is_recorded, is_learned
    )
