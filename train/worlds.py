"""Renders many short, varied recordings of the synthetic world, for `train.cache synth`.

    python -m train.worlds OUT --count 250 --program target/release/yfslam

Every setting is drawn from a generator seeded with the number of the recording, so that the same command writes the same images.
Frames are more than a second apart. Existing recordings are kept.
"""

import argparse
import pathlib
import subprocess

import numpy as np


def spec(number, rng, empty, share):
    """Returns the description of a world: a share `empty` of them have no people, in the others people cover `share` (least, most)
    of the image."""
    people = 0 if rng.random() < empty else int(rng.integers(1, 6))
    keys = {
        "seed": number + 1,
        "scene": rng.choice(["office", "rescue", "corridor", "lab"]),
        "motion": rng.choice(["static", "xyz", "rpy", "halfsphere", "drive", "loop"]),
        "activity": rng.choice(["sitting", "walking", "walking", "crowd"]),
        "people": people,
        "robots": int(rng.integers(1, min(3, 7 - people))) if rng.random() < 0.3 else 0,
        "share": round(rng.uniform(*share), 2),
        "exposure": round(float(np.exp(rng.uniform(-0.6, 0.5))), 2),
        "flicker": round(rng.uniform(0, 0.5), 2) if rng.random() < 0.3 else 0,
        "width": 480, "height": 360, "fps": 0.7, "frames": 6,
    }
    if people and keys["activity"] == "walking" and rng.random() < 0.3:
        keys[rng.choice(["chair", "carry"])] = "on"
    return "synth:?" + "&".join(f"{key}={value}" for key, value in keys.items())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=250)
    parser.add_argument("--first", type=int, default=0, help="number of the first recording")
    parser.add_argument("--empty", type=float, default=0.2, help="share of recordings without people")
    parser.add_argument("--share", type=float, nargs=2, default=[0.1, 0.6], help="share of the image that people cover, least and most")
    parser.add_argument("--program", default="yfslam")
    options = parser.parse_args()
    for number in range(options.first, options.first + options.count):
        folder = options.out / f"{number:04}"
        if not (folder / "boxes.json").exists():
            world = spec(number, np.random.default_rng([17, number]), options.empty, options.share)
            done = subprocess.run([options.program, "synth", world, "--out", folder, "--force"], capture_output=True, text=True)
            if done.returncode:
                print(f"left out: {done.stderr.strip().splitlines()[-1]}")


if __name__ == "__main__":
    main()
