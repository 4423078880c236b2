"""Computes average precision and recall from detected and true boxes."""

import numpy as np

from .decode import iou


def match(boxes, truth, least=0.5):
    """Returns, for each detected box (best first), the true box it is assigned to, or -1. Each true box is assigned once."""
    free = np.ones(len(truth), bool)
    given = np.full(len(boxes), -1)
    for index, box in enumerate(boxes):
        if len(truth):
            overlap = np.where(free, iou(box, truth), 0)
            best = overlap.argmax()
            if overlap[best] >= least:
                given[index], free[best] = best, False
    return given


def summary(found, truths, score=0.3, tall=0.3):
    """found: (boxes, scores) of each image, with scores from near 0 on; truths: true boxes of each image; all relative.

    AP50: area under precision over recall at IoU 0.5, with monotone precision. The other metrics are at scores above `score`.
    """
    scores, right, hits, talls, tall_hits, reported, correct = [], [], 0, 0, 0, 0, 0
    for (boxes, values), truth in zip(found, truths):
        given = match(boxes, truth)
        scores.append(values)
        right.append(given >= 0)
        sure = values > score
        reported += sure.sum()
        seen = np.unique(given[sure & (given >= 0)])
        correct += len(seen)
        high = truth[:, 3] - truth[:, 1] > tall
        talls += high.sum()
        tall_hits += high[seen].sum()
    total = sum(len(truth) for truth in truths)
    scores, right = np.concatenate(scores), np.concatenate(right)
    order = np.argsort(-scores, kind="stable")
    true = np.cumsum(right[order])
    recall, precision = true / max(total, 1), true / np.arange(1, len(true) + 1)
    precision = np.maximum.accumulate(precision[::-1])[::-1]
    ap = float((np.diff(recall, prepend=0) * precision).sum())
    return {"AP50": ap, "recall": correct / max(total, 1), "precision": correct / max(reported, 1),
            "tall_recall": tall_hits / max(talls, 1), "people": total, "tall": int(talls), "pictures": len(truths)}
