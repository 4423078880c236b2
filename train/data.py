"""Reads caches and returns batches. Sample number n of a training depends on (seed, n) alone, so that a resumed training gets the
same samples as an uninterrupted one.
"""

import pathlib

import cv2
import numpy as np
import torch

from . import augment

MOST_BOXES = 24  # per image


class Cache:
    """One cached source; `classes` is the list of the network, and boxes of other classes are dropped. `labelled`: 1 for each class
    of the network for which the cache has labels."""

    def __init__(self, folder, classes, held_out=False):
        folder = pathlib.Path(folder)
        self.images = np.load(folder / "images.npy", mmap_mode="r")
        labels = np.load(folder / "labels.npz")
        names = [str(name) for name in labels["classes"]]
        self.labelled = np.array([name in names for name in classes], np.float32)
        number = np.array([classes.index(name) if name in classes else -1 for name in names])
        first = labels["first"]
        self.chosen = np.flatnonzero(labels["held_out"] == held_out)
        self.empty = not len(labels["boxes"])  # photos without people
        self.boxes = []
        for index in range(len(self.images)):
            rows = labels["boxes"][first[index]:first[index + 1]].astype(np.float64)
            rows[:, 0] = number[rows[:, 0].astype(int)]
            self.boxes.append(rows[rows[:, 0] >= 0])
        # a scene with 30 images counts like 5 or 6 scenes, not like 30
        group = labels["group"][self.chosen]
        size = np.bincount(group)[group]
        self.weight = size**-0.5
        if (folder / "hard.npy").exists():  # from train.mine
            self.weight *= np.load(folder / "hard.npy")[self.chosen]
        self.weight /= self.weight.sum()
        self.cumulated = np.cumsum(self.weight)

    def draw(self, rng):
        at = min(np.searchsorted(self.cumulated, rng.random()), len(self.chosen) - 1)
        index = self.chosen[at]
        return self.images[index], self.boxes[index]


class Samples(torch.utils.data.Dataset):
    """Item (n, side, mosaic, strength) is training image n. `shares` are the probabilities of the caches; `empty`: share
    of the images with people that are reduced to a part without people."""

    def __init__(self, caches, shares, seed, empty=0.5):
        self.caches, self.shares, self.seed, self.empty = caches, np.cumsum(np.array(shares) / np.sum(shares)), seed, empty

    def __getitem__(self, item):
        number, side, mosaic, strength = item
        rng = np.random.default_rng([self.seed, number])
        # all parts of a mosaic come from one cache, so that one list of labelled classes is valid for the image
        cache = self.caches[min(int(np.searchsorted(self.shares, rng.random())), len(self.caches) - 1)]
        image, boxes, ignored = augment.sample(rng, cache.draw, side, mosaic, strength, self.empty, cache.empty)
        targets = np.full((MOST_BOXES, 5), -1, np.float32)
        order = np.argsort(-(boxes[:, 3] - boxes[:, 1]) * (boxes[:, 4] - boxes[:, 2]), kind="stable")[:MOST_BOXES]
        targets[:len(order)] = boxes[order]
        mask = np.zeros((side // 16, side // 16), np.uint8)
        for x0, y0, x1, y1 in ignored / 16:
            mask[int(y0):int(np.ceil(y1)), int(x0):int(np.ceil(x1))] = 1
        return torch.from_numpy(image), torch.from_numpy(targets), torch.from_numpy(mask), torch.from_numpy(cache.labelled)


def start_worker(_):
    cv2.setNumThreads(0)
    torch.set_num_threads(1)


def loader(samples, batches, workers):
    """Returns a loader; `batches` yields lists of items."""
    return torch.utils.data.DataLoader(samples, batch_sampler=batches, num_workers=workers, worker_init_fn=start_worker,
                                       prefetch_factor=4 if workers else None)
