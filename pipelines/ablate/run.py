"""Does the work of a plan, each piece once: what lies finished in the folder is not made again."""

import itertools

from pipelines.ablate.folder import ResultsFolder
from pipelines.ablate.hints import frames_told
from pipelines.ablate.jobs import CorpusJob, ScoringJob, TrainingJob
from pipelines.ablate.libraries import SPLIT
from pipelines.ablate.models import read_contestant, train_model
from pipelines.ablate.plan import Plan
from pipelines.ablate.progress import Job, SetShare, WorkProgress, cost
from pipelines.corpus import write_corpus
from pipelines.corpus.rooms.views import frames_shown
from pipelines.errors import CorpusError
from pipelines.generation.drawn import drawn_order
from pipelines.generation.libraries import LibraryUse
from pipelines.metrics.document import pixel_values
from pipelines.metrics.results import write_results
from pipelines.metrics.truths import truths_of_frames
from pipelines.models.asking import predict_frames
from pipelines.models.checkpoints import drop_trees
from pipelines.models.training import partial_folder


def run_plan(plan: Plan, folder: ResultsFolder, n_threads: int) -> None:
    """Makes corpora, models and rows.

    Args:
        plan: What to make.
        folder: Where finished work lies.
        n_threads: Threads, for corpora processes; the results do not depend on it.
    """
    folder.prepare()
    for kind in {job.kind.name: job.kind for job in plan.trainings}.values():
        kind.tools()  # says what is missing before any work
    scorings = [job for job in plan.scorings if not folder.rows(job).exists()]
    trainings = [job for job in plan.trainings if not folder.model(job).exists()]
    for training in plan.trainings:
        if training not in trainings:
            drop_trees(partial_folder(folder.model(training)))
    corpora = [job for job in plan.corpora if not _is_finished(folder, job)]
    left: list[Job] = [*corpora, *trainings, *scorings]
    with WorkProgress(sum(map(cost, left))) as progress:
        for corpus in corpora:
            with progress.step("frames", cost(corpus)) as set_share:
                _make_corpus(corpus, folder, n_threads, set_share)
        for training in trainings:
            with progress.step(f"train {training.row} {training.config.seed}", cost(training)) as set_share:
                _train(training, folder, n_threads, set_share)
        for scoring in scorings:
            with progress.step(f"score {scoring.training.row}", cost(scoring)) as set_share:
                _score(scoring, folder, n_threads, set_share)


def _is_finished(folder: ResultsFolder, job: CorpusJob) -> bool:
    try:
        folder.open_corpus(job)
    except CorpusError:
        return False
    return True


def _make_corpus(job: CorpusJob, folder: ResultsFolder, n_threads: int, set_share: SetShare) -> None:
    poses, objects = (
        None if library is None else LibraryUse(library.path, 1.0, (SPLIT,))
        for library in (job.imported.poses, job.imported.objects)
    )
    order = drawn_order(job.scene, job.config.seed, job.n_frames, poses=poses, objects=objects)
    write_corpus(folder.corpus(job), order, n_threads, lambda n_done, _: set_share(n_done / job.n_frames))


def _train(job: TrainingJob, folder: ResultsFolder, n_threads: int, set_share: SetShare) -> None:
    corpus = folder.open_corpus(job.corpus)
    train, val = (
        frames_told(frames_shown(corpus, frames.of(corpus), job.sensor, job.place), job.told)
        for frames in (job.train, job.val)
    )
    train_model(job, corpus.digest, train, val, folder.model(job), n_threads, set_share)


def _score(job: ScoringJob, folder: ResultsFolder, n_threads: int, set_share: SetShare) -> None:
    corpus = folder.open_corpus(job.corpus)
    shown = frames_shown(corpus, job.test.of(corpus), job.sensor, job.place)
    frames = frames_told(shown, job.training.told)
    n_done = itertools.count(1)
    results, confusion = predict_frames(
        read_contestant(job, folder.model(job.training)),
        frames,
        truths_of_frames(shown),
        n_threads,
        lambda: set_share(next(n_done) / len(frames)),
    )
    context = {
        "key": job.key,
        "row": job.training.row,
        "seed": job.training.config.seed,
        "model": {"key": job.training.key, "file": folder.model(job.training).name},
        "corpus": {"folder": folder.corpus(job.corpus).name, "digest": corpus.digest},
        "pixels": None if confusion is None else pixel_values(confusion),
    }
    write_results(folder.rows(job), [results], context)
