"""Shows recall and false alarms of a network if another score than 0.3 became 0.3, for the choice of `train.export --as-0.3`.

    python -m train.scores CACHE MODEL [--rooms FOLDER...] [--data DATA] [--empty FOLDER] [--scores 0.3 0.35 0.4 ...]

One row per score: recall of tall people on the held-out images of CACHE and precision there, false alarms per 100 photos without
people (as in train.evaluate), share of frames of labels/bonn_crowd_dev_100.json in which all people are covered, boxes per frame of it
without people, false alarms per frame of tum_fr1_xyz_dev and of recordings without people (FOLDER/*/rgb). Boxes are fused by their
scores, so that the figures of the exported network can differ slightly.
"""

import argparse
import pathlib

import numpy as np

from .data import Cache
from .evaluate import Network, crowd, false_alarms, held_out, empty_recordings, rooms


class Remembering:
    """A network that processes each image once."""

    def __init__(self, network):
        self.network, self.found = network, {}

    def __call__(self, image, least=0.01):
        key = hash(image.tobytes())
        if key not in self.found:
            self.found[key] = self.network(image, least)
        return self.found[key]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("model", type=pathlib.Path)
    parser.add_argument("--data", type=pathlib.Path, help="folder of development data, with rgbd/")
    parser.add_argument("--empty", type=pathlib.Path, help="folder of recordings without people, each with rgb/")
    parser.add_argument("--rooms", type=pathlib.Path, nargs="+", default=[], help="folders or caches of photos without people")
    parser.add_argument("--scores", type=float, nargs="+", default=np.arange(0.26, 0.72, 0.02).tolist())
    options = parser.parse_args()
    cache = Cache(options.cache, ["person"], held_out=True)
    network = Remembering(Network(options.model))
    for score in options.scores:
        photos = held_out(network, cache, score=score)
        row = {"score": score, "tall": photos["tall_recall"], "precision": photos["precision"]}
        for path in options.rooms:
            row[f"rooms {path.name}"] = rooms(network, path, score)["false_per_100"]
        if options.data:
            bonn = crowd(network, options.data, score)
            row |= {"all found": bonn["all_at_iou_.5"], "empty frame": bonn["false_per_empty_frame"]}
            row["desk"] = false_alarms(network, options.data, score)["false_per_frame"]
        if options.empty:
            row["no people"] = empty_recordings(network, options.empty, score)["false_per_frame"]
        if score == options.scores[0]:
            print("  ".join(row))
        print("  ".join(f"{value:{len(name)}.3f}" for name, value in row.items()), flush=True)


if __name__ == "__main__":
    main()
