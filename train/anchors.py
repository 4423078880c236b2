"""Computes six anchors from the boxes of augmented training images: k-means with 1 - IoU of the sides as distance (YOLOv2: Redmon,
2017).

    python -m train.anchors CACHE...
"""

import sys

import numpy as np

from .data import Cache, Samples


def overlap(sides, anchors):
    shared = np.minimum(sides[:, None], anchors).prod(2)
    return shared / (sides.prod(1)[:, None] + anchors.prod(1) - shared)


def cluster(sides, count=6, rounds=100):
    spread = (np.linspace(0.08, 0.92, count) * (len(sides) - 1)).astype(int)
    anchors = sides[np.argsort(sides.prod(1))[spread]]
    for _ in range(rounds):
        nearest = overlap(sides, anchors).argmax(1)
        anchors = np.array([np.median(sides[nearest == k], 0) if (nearest == k).any() else anchors[k] for k in range(count)])
    return anchors[np.argsort(anchors.prod(1))]


def main():
    from .config import Config
    config = Config()
    caches = [Cache(folder, config.classes) for folder in sys.argv[1:]]
    samples = Samples(caches, [1] * len(caches), config.seed)
    targets = np.concatenate([samples[(n, 352, 0.35, 1.0)][1].numpy() for n in range(4000)])
    targets = targets[targets[:, 0] >= 0]
    sides = targets[:, 3:5] - targets[:, 1:3]
    anchors = cluster(sides)
    best = overlap(sides, anchors).max(1)
    print(np.round(anchors, 1).reshape(2, 3, 2).tolist(), f"mean best IoU {best.mean():.3f}, of {len(sides)} boxes")


if __name__ == "__main__":
    main()
