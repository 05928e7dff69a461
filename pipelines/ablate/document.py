"""ablation.json: settings, versions, digests and scores of an ablation; docs/ablation.md describes the keys."""

import json
from collections.abc import Mapping

import numpy as np

from pipelines.ablate.config import AblationConfig
from pipelines.ablate.digests import sources_digest, versions
from pipelines.ablate.folder import ResultsFolder
from pipelines.ablate.jobs import CorpusJob, ScoringJob
from pipelines.ablate.plan import Condition, Plan
from pipelines.ablate.schema import PAPER_MAP_10CM, SCHEMA, SCHEMA_VERSION
from pipelines.ablate.table import Resampling, pair_document, pair_scores, row_scores
from pipelines.metrics import draw_frames
from pipelines.metrics.results import Results, read_results
from pipelines.models.opening import file_digest
from storage.atomic import write_atomically


def make_document(config: AblationConfig, plan: Plan, folder: ResultsFolder) -> dict:
    """Scores finished rows.

    Returns:
        JSON values; the same for the same configuration, versions and sources, but for `seconds_per_frame`.
    """
    main, *others = plan.conditions
    questions: dict[str, list[dict]] = {name: [] for name in config.questions}
    for condition in others:
        assert condition.question is not None
        questions[condition.question].append(_condition_document(condition, config, folder))
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "settings": _settings(config, plan),
        "software": versions(),
        "sources": {name: sources_digest(name) for name in ("synth", "forests", "pipelines/metrics")},
        "corpora": [_corpus_document(job, folder) for job in plan.corpora],
        "paper_map_10cm": dict(PAPER_MAP_10CM),
        "main": _condition_document(main, config, folder),
        "questions": questions,
    }


def write_document(document: dict, folder: ResultsFolder) -> None:
    """Writes ablation.json."""
    write_atomically(folder.document, json.dumps(document, indent=1, allow_nan=False) + "\n")


def _settings(config: AblationConfig, plan: Plan) -> dict:
    """The configuration with digests of libraries in the place of their paths."""
    digests = [job.imported.digests for job in plan.corpora]
    of = {name: next((item[name] for item in digests if item[name]), None) for name in ("poses", "objects")}
    return config.plain() | {"test_poses": of["poses"], "test_objects": of["objects"]}


def _corpus_document(job: CorpusJob, folder: ResultsFolder) -> dict:
    corpus = folder.open_corpus(job)
    return {
        "folder": folder.corpus(job).name,
        "key": job.key,
        "digest": corpus.digest,
        "is_context_kept": job.scene.is_context_kept,
        "imported": job.imported.digests,
        "n_frames": {split: len(corpus.split(split)) for split in ("train", "val", "test")},
    }


def _condition_document(condition: Condition, config: AblationConfig, folder: ResultsFolder) -> dict:
    resampling = Resampling(config.n_resamples)
    answers: dict[str, list[Results]] = {}
    rows = {}
    for row in condition.rows:
        jobs = condition.of_row(row)
        read = [read_results(folder.rows(job)) for job in jobs]
        answers[row] = [results for (results,), _ in read]
        weights = draw_frames(len(answers[row][0].truths), resampling.n, resampling.rng())
        rows[row] = row_scores(answers[row], weights) | {
            "pixels": [context["pixels"] for _, context in read],
            "seconds_per_frame": float(np.median(np.concatenate([item.seconds for item in answers[row]]))),
            "trainings": [_training_document(job, folder) for job in jobs],
        }
    return {
        "settings": dict(condition.settings),
        "rows": rows,
        "differences": pair_scores(answers, resampling) | _compared(condition, answers, resampling, folder),
    }


def _compared(
    condition: Condition, answers: Mapping[str, list[Results]], resampling: Resampling, folder: ResultsFolder
) -> dict[str, dict]:
    """Differences from other conditions, by "method - method NAME"."""
    documents = {}
    for name, jobs in condition.compared:
        for row, here in answers.items():
            there = [read_results(folder.rows(job))[0][0] for job in jobs if job.training.row == row]
            pairs = list(zip(here, there, strict=False))
            documents[f"{row} - {row} {name}"] = pair_document(pairs, resampling)
    return documents


def _training_document(job: ScoringJob, folder: ResultsFolder) -> dict:
    model = folder.model(job.training)
    return {
        "seed": job.training.config.seed,
        "corpus": folder.corpus(job.training.corpus).name,
        "n_train_frames": len(job.training.train.of(folder.open_corpus(job.training.corpus))),
        "model": {"file": f"models/{model.name}", "key": job.training.key, "digest": file_digest(model)},
        "rows": {
            "file": f"rows/{folder.rows(job).name}",
            "key": job.key,
            "corpus": folder.corpus(job.corpus).name,
        },
    }
