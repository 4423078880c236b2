"""Measures the detection of people by a rolled camera: in the images as they are, and with roll compensation as in the tracker.

    python -m train.upright CACHE --program target/release/yfslam [--detector MODEL] [--integers] [--angles 0] [--rooms FOLDER...]

On the held-out images of CACHE, rotated by 30, 60 and 90 degrees to either side; it measures `yfslam detect --roll`. With --rooms, also
the number of boxes per 100 photos without people (folders of photos, or caches of `train.cache empty`), by the same program.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

import cv2
import numpy as np

from .data import Cache
from .evaluate import room_photos, turned
from .metrics import summary


def found(program, own, folder, roll):
    """Returns boxes (corners, relative) and scores of each image of the folder, in the order of their names."""
    command = [program, "detect", folder, "--roll", str(roll), "--score", "0.01", "--out", folder / "out", "--quiet", *own]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for image in json.loads((folder / "out/boxes.json").read_text())["images"]:
        rows = [b for b in image["boxes"] if b["class"] == "person"]
        size = np.array([image["width"], image["height"]] * 2)
        boxes = np.array([b["bbox"] for b in rows]).reshape(-1, 4)
        yield boxes / size, np.array([b["score"] for b in rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--detector", type=pathlib.Path, help="model file (default: the embedded model)")
    parser.add_argument("--integers", action="store_true", help="run `yfslam detect --integers`")
    parser.add_argument("--angles", type=int, nargs="+", default=[0, 30, 60, 90], help="degrees")
    parser.add_argument("--rooms", type=pathlib.Path, nargs="+", default=[], help="folders or caches of photos without people")
    options = parser.parse_args()
    own = ["--detector", options.detector] * bool(options.detector) + ["--integers"] * options.integers
    cache = Cache(options.cache, ["person"], held_out=True)
    for path in options.rooms:
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for number, photo in enumerate(room_photos(path)):
                cv2.imwrite(str(folder / f"{number:06}.png"), photo)
            counts = np.array([(scores > 0.3).sum() for _, scores in found(options.program, own, folder, 0)])
        print(f"rooms {path.name}: photos {len(counts)} false_per_100 {100 * counts.mean():.2f} photos_with_any {(counts > 0).mean():.3f}", flush=True)
    for angle in options.angles:
        as_is, upright, truths = [], [], []
        for degrees in sorted({angle, -angle}):
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                for number, index in enumerate(cache.chosen):
                    picture, truth = turned(np.array(cache.images[index]), cache.boxes[index][:, 1:], degrees)
                    cv2.imwrite(str(folder / f"{number:06}.png"), picture)
                    truths.append(truth)
                as_is += found(options.program, own, folder, 0)
                upright += found(options.program, own, folder, degrees)
        for name, boxes in (("as it is", as_is), ("set upright", upright)):
            row = summary(boxes, truths)
            print(f"turned {angle:2}, {name:11}", " ".join(f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()))


if __name__ == "__main__":
    main()
