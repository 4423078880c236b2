"""What a network would find and report if another score than 0.3 became 0.3: for the choice of `train.export --as-0.3`.

    python -m train.scores CACHE MODEL --data DATA [--empty FOLDER] [--scores 0.3 0.35 0.4 ...]

A row per score: tall people found on the held-out pictures of CACHE and precision there, frames of labels/bonn_crowd_dev_100.json in
which everybody is covered, boxes per frame of it without people, false alarms per frame of tum_fr1_xyz_dev and of recordings without
people (FOLDER/*/rgb). Boxes are fused by their scores: the exported network's figures can differ by a hair.
"""

import argparse
import pathlib

import numpy as np

from .data import Cache
from .evaluate import Network, crowd, false_alarms, held_out, nobody


class Remembering:
    """A network that looks at each picture once."""

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
    print("score  tall  precision  everybody  empty frame  desk" + ("  nobody" if options.empty else ""))
    for score in options.scores:
        photos, bonn = held_out(network, cache, score=score), crowd(network, options.data, score)
        desk = false_alarms(network, options.data, score)["false_per_frame"]
        row = f"{score:5.3f}  {photos['tall_recall']:.3f}      {photos['precision']:.3f}      {bonn['all_at_iou_.5']:.3f}        {bonn['false_per_empty_frame']:.3f} {desk:.3f}"
        if options.empty:
            row += f"   {nobody(network, options.empty, score)['false_per_frame']:.3f}"
        print(row, flush=True)


if __name__ == "__main__":
    main()
