"""Slow, obvious twins of the metrics."""

import numpy as np


def average_precision(confidence, distance, within=0.1):
    """Area under the precision-recall curve of one joint: one threshold after the other.

    Args:
        confidence: (n_frames, n_proposals), falling in each row.
        distance: (n_frames, n_proposals), NaN where there is no proposal.
        within: Distance of a true proposal.
    """
    made = []
    for row_confidence, row_distance in zip(confidence, distance, strict=True):
        is_found = False
        for c, d in zip(row_confidence, row_distance, strict=True):
            if np.isnan(d):
                continue
            is_true = d <= within and not is_found
            is_found = is_found or is_true
            made.append((c, is_true))
    area, recall_before = 0.0, 0.0
    for threshold in sorted({c for c, _ in made}, reverse=True):
        kept = [is_true for c, is_true in made if c >= threshold]
        recall, precision = sum(kept) / len(confidence), sum(kept) / len(kept)
        area += (recall - recall_before) * precision
        recall_before = recall
    return area


def repeated(values, counts):
    """Rows as often as they were drawn."""
    return np.repeat(values, counts, axis=0)
