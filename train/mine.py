"""Finds hard photos without people, which are then drawn more often in training.

    python -m train.mine CACHE MODEL        # writes CACHE/hard.npy; train.data multiplies the probabilities of images by it

MODEL: a checkpoint or an ONNX file. Every training image of a cache without people (`train.cache empty`) is seen as it is, mirrored,
rolled to both sides, and enlarged; an image without any detection has the weight 1, one with a detection of score 1 has the weight 1 +
GAIN. Running it again, with a later checkpoint, replaces the weights. Training samples then differ, so that it is part of the recipe.
"""

import argparse
import pathlib

import cv2
import numpy as np

from .data import Cache
from .evaluate import Network

GAIN = 5.0
LEAST = 0.05  # score


def views(image):
    """Yields the image as it is, mirrored, rolled by 20 degrees to both sides, and its middle enlarged."""
    side = image.shape[0]
    yield image
    yield np.ascontiguousarray(image[:, ::-1])
    for degrees, zoom in ((20, 1.0), (-20, 1.0), (0, 1.7)):
        affine = cv2.getRotationMatrix2D((side / 2 - 0.5, side / 2 - 0.5), degrees, zoom)
        yield cv2.warpAffine(image, affine, (side, side), flags=cv2.INTER_LINEAR, borderValue=(114, 114, 114))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("model", type=pathlib.Path)
    options = parser.parse_args()
    (options.cache / "hard.npy").unlink(missing_ok=True)
    cache, network = Cache(options.cache, ["person"]), Network(options.model)
    if not cache.empty:
        parser.error(f"{options.cache} has boxes; only photos without people can be mined")
    worst = np.zeros(len(cache.images))
    for index in cache.chosen:
        worst[index] = max(max(network(view, LEAST)[1], default=0.0) for view in views(np.array(cache.images[index])))
    np.save(options.cache / "hard.npy", 1 + GAIN * worst)
    print(f"{(worst > 0.3).sum()} of {len(cache.chosen)} photos with a detection above 0.3, {(worst > LEAST).sum()} above {LEAST}")


if __name__ == "__main__":
    main()
