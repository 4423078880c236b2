"""Shows recall and false alarms of a network if another score than 0.3 became 0.3, for the choice of `train.export --as-0.3`.

    python -m train.scores CACHE MODEL --data DATA [--empty FOLDER] [--scores 0.3 0.35 0.4 ...]

One row per score: recall of tall people on the held-out images of CACHE and precision there, share of frames of
labels/bonn_crowd_dev_100.json in which all people are covered, boxes per frame of it without people, false alarms per frame of
tum_fr1_xyz_dev and of recordings without people (FOLDER/*/rgb). Boxes are fused by their scores, so that the figures of the
exported network can differ slightly.
"""

import argparse
import pathlib

import numpy as np

from .data import Cache
from .evaluate import Network, crowd, false_alarms, held_out, empty_recordings


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
    parser.add_argument("--data", type=pathlib.Path, required=True, help="folder of development data, with rgbd/")
    parser.add_argument("--empty", type=pathlib.Path, help="folder of recordings without people, each with rgb/")
    parser.add_argument("--scores", type=float, nargs="+", default=np.arange(0.26, 0.72, 0.02).tolist())
    options = parser.parse_args()
    cache = Cache(options.cache, ["person"], held_out=True)
    network = Remembering(Network(options.model))
    print("score  tall  precision  all found  empty frame  desk" + ("  no people" if options.empty else ""))
    for score in options.scores:
        photos, bonn = held_out(network, cache, score=score), crowd(network, options.data, score)
        desk = false_alarms(network, options.data, score)["false_per_frame"]
        row = f"{score:5.3f}  {photos['tall_recall']:.3f}      {photos['precision']:.3f}      {bonn['all_at_iou_.5']:.3f}        {bonn['false_per_empty_frame']:.3f} {desk:.3f}"
        if options.empty:
            row += f"   {empty_recordings(network, options.empty, score)['false_per_frame']:.3f}"
        print(row, flush=True)


if __name__ == "__main__":
    main()
