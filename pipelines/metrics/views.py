"""Scores of several cameras together: what each says of a person is fused, and compared with what fewer see."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.metrics.document import summary_values
from pipelines.metrics.fusing import FusionConfig, fuse
from pipelines.metrics.measures import summarise
from pipelines.metrics.resampling import FrameWeights
from pipelines.metrics.results import Results, Truths
from pipelines.spread import at_most
from synth.vocabulary import MAX_PEOPLE, JointState


@dataclass(frozen=True)
class Sight:
    """One person of a scene at one moment, as all cameras see them.

    Attributes:
        clip: Place of the clip, or of the scene, among those that are scored.
        rows: (n_views,) int64, their row in the results of each camera; -1 where they need not be found.
        eyes: (n_views, 4, 4) T_world_camera.
    """

    clip: int
    rows: NDArray[np.int64]
    eyes: NDArray[np.float64]


def whole_scenes(corpus: Corpus, numbers: NDArray[np.int64], limit: int) -> NDArray[np.int64]:
    """Frames of a split of which at most so many are scored, evenly spread; all cameras of a moment or none.

    Args:
        corpus: An open corpus.
        numbers: (n,) frame numbers, in order.
        limit: 0 = all.
    """
    n_views = corpus.header.cameras
    if n_views == 1 or not limit or len(numbers) % n_views:
        return numbers[at_most(len(numbers), limit)]
    moments = numbers.reshape(-1, n_views)
    return moments[at_most(len(moments), max(1, limit // n_views))].ravel()


def clips_of_rows(corpus: Corpus, numbers: NDArray[np.int64], results: Results) -> tuple[NDArray[np.int64], int]:
    """(n,) int64: the clip of each row, or the scene that several cameras see; a place among those of some frames.

    Args:
        corpus: A corpus of several cameras.
        numbers: The frames that were asked about, all of one split.
        results: The answers.

    Returns:
        The places, and how many clips there are.
    """
    clips = np.unique(corpus.arrays("clip", numbers))
    return np.searchsorted(clips, corpus.arrays("clip", frames_of_rows(corpus, results))), len(clips)


def frames_of_rows(corpus: Corpus, results: Results) -> NDArray[np.int64]:
    """(n,) int64: the frame number of each row, which is one a person in rooms."""
    frame = results.truths.frame
    return frame // MAX_PEOPLE if corpus.header.has_rooms else frame


def view_document(
    corpus: Corpus,
    numbers: NDArray[np.int64],
    results: Results,
    weights: FrameWeights,
    config: FusionConfig | None = None,
) -> list[dict]:
    """What one camera, two, four, ... and all of them find together, as JSON values; docs/metrics.md has the keys.

    Every set of so many cameras is asked about everybody who ought to be found by at least one camera of the scene, so
    that a set of cameras that do not see somebody answers nothing, which is wrong.

    Args:
        corpus: A corpus of several cameras.
        numbers: The frames that were asked about, all of one split.
        results: The answers.
        weights: (n_resamples, n_clips), how often each clip counts, in the order of `clips_of_rows`.
        config: How skeletons are fused; None = as `FusionConfig` has it.
    """
    sights = list(_sights(corpus, numbers, results))
    if not sights:
        return []
    config = config or FusionConfig()
    probability = np.nan_to_num(results.probability.astype(np.float64), nan=1.0)
    n_views = corpus.header.cameras
    document = []
    for n in sorted({1 << k for k in range(n_views.bit_length()) if 1 << k <= n_views} | {n_views}):
        sets = list(itertools.combinations(range(n_views), n))
        fused = _fused(results, probability, sights, sets, config)
        seen = fused.truths.state == JointState.VISIBLE
        drawn = weights[:, np.repeat([sight.clip for sight in sights], len(sets))]
        groups = {"visible": seen, "not_visible": ~seen}
        of_all = summary_values(summarise(fused, np.ones_like(seen), drawn))
        document.append(
            {"n_views": n, "n_sets": len(sets), "n_people": len(sights)}
            | of_all
            | {name: summary_values(summarise(fused, is_in, drawn)) for name, is_in in groups.items()}
        )
    return document


def view_lines(document: Sequence[dict] | None) -> Iterator[str]:
    """The terminal's table of cameras; nothing of a corpus of one."""
    if not document:
        return
    yield ""
    shown = {"accuracy_10cm": 1.0, "mean_error_cm": 1.0, "missing": 1.0}
    heads = ("accuracy 10 cm", "mean error [cm]", "missing", "seen by none")
    yield f"{'cameras':<10}{'people':>8}" + "".join(f"{head:>24}" for head in heads)
    for row in document:
        cells = [_cell(row, name) for name in shown] + [_cell(row["not_visible"], "accuracy_10cm")]
        yield f"{row['n_views']:<10}{row['n_people']:>8}" + "".join(f"{cell:>24}" for cell in cells)


def _cell(values: dict, name: str) -> str:
    if values[name] is None:
        return "-"
    digits = 1 if name.endswith("_cm") else 3
    low, high = (("-" if end is None else f"{end:.{digits}f}") for end in values[f"{name}_ci"])
    return f"{values[name]:.{digits}f} [{low}, {high}]"


def _sights(corpus: Corpus, numbers: NDArray[np.int64], results: Results) -> Iterator[Sight]:
    """Everybody who ought to be found by a camera, of the moments that all cameras were asked about."""
    n_views = corpus.header.cameras
    clip, time, view = (corpus.arrays(name, numbers).astype(np.int64) for name in ("clip", "time", "view"))
    clip = np.searchsorted(np.unique(clip), clip)
    moment = np.unique(np.stack([clip, time], axis=1), axis=0, return_inverse=True)[1].ravel()
    place = np.full((moment.max(initial=-1) + 1, n_views), -1, np.int64)
    place[moment, view] = np.arange(len(numbers))
    frame, person = results.truths.frame, np.zeros(len(results.truths), np.int64)
    if corpus.header.has_rooms:
        frame, person = frame // MAX_PEOPLE, frame % MAX_PEOPLE
    row_of = {key: row for row, key in enumerate(zip(frame.tolist(), person.tolist(), strict=True))}
    poses = corpus.arrays("T_world_camera", numbers)
    for at in place[(place >= 0).all(axis=1)]:
        for k in range(MAX_PEOPLE if corpus.header.has_rooms else 1):
            rows = np.array([row_of.get((number, k), -1) for number in numbers[at].tolist()])
            if (rows >= 0).any():
                yield Sight(int(clip[at[0]]), rows, poses[at])


def _fused(
    results: Results,
    probability: NDArray[np.float64],
    sights: Sequence[Sight],
    sets: Sequence[tuple[int, ...]],
    config: FusionConfig,
) -> Results:
    """The answers of sets of cameras, a row a person and set, in the frame of reference of the world.

    The state of a joint is visible where one of all cameras sees it.
    """
    n_joints = len(results.truths.joints)
    n = len(sights) * len(sets)
    joints = np.full((n, n_joints, 1, 3), np.nan, np.float32)
    told = np.zeros((n, n_joints), np.float32)
    truth = np.full((n, n_joints, 3), np.nan, np.float32)
    state = np.zeros((n, n_joints), np.uint8)
    first = np.zeros(n, np.int64)
    for k, sight in enumerate(sights):
        has_row = sight.rows >= 0
        one = sight.rows[has_row]
        turn, eye = sight.eyes[:, :3, :3], sight.eyes[:, :3, 3]
        answers = results.proposals[sight.rows, :, 0].astype(np.float64)
        answers = np.einsum("vab,vjb->vja", turn, answers) + eye[:, None]
        sure = np.where(has_row[:, None], probability[sight.rows], 0.0)
        v = int(np.flatnonzero(has_row)[0])
        true = results.truths.xyz[one[0]].astype(np.float64) @ turn[v].T + eye[v]
        is_seen = (results.truths.state[one] == JointState.VISIBLE).any(axis=0)
        own = slice(k * len(sets), (k + 1) * len(sets))
        first[own], truth[own] = one[0], true
        state[own] = np.where(is_seen, JointState.VISIBLE, results.truths.state[one[0]])
        for row, chosen in enumerate(sets, own.start):
            some = list(chosen)
            joints[row, :, 0], told[row] = fuse(answers[some], sure[some], eye[some], config)
    return Results(
        results.method,
        _rows(results, first, truth, state),
        joints,
        told[..., None],
        told,
        told,
        np.zeros(n, np.float32),
    )


def _rows(
    results: Results, first: NDArray[np.int64], truth: NDArray[np.float32], state: NDArray[np.uint8]
) -> Truths:
    """The truths of fused rows, each with a row of one camera; nothing in an image is told of them."""
    truths = results.truths
    of_frame = ("frame", "intrinsics", "visible_fraction", "family", "object_classes")
    chosen = {name: getattr(truths, name)[first] for name in of_frame}
    return replace(
        truths,
        **chosen,
        upper_body_px=np.full(len(first), np.nan, np.float32),
        xyz=truth,
        state=state,
        hiding_class=truths.hiding_class[first],
    )
