#!/usr/bin/env python3
"""Times feature extraction beside OpenCV's ORB: one thread each, 1,000 features, the same grey images.

python3 crates/yfslam-bench/peers/peers_features.py [DATA_FOLDER] [--runs 100]        (pip: opencv-python-headless)

Both take turns for three rounds on each image; reported are the least time and the least median of the rounds, in ms.
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import tempfile
import time

import cv2

ROOT = pathlib.Path(__file__).resolve().parents[3]


def opencv(image, runs):
    orb, times = cv2.ORB_create(1000), []
    orb.detectAndCompute(image, None)
    for _ in range(runs):
        start = time.perf_counter()
        points, _ = orb.detectAndCompute(image, None)
        times.append((time.perf_counter() - start) * 1e3)
    return min(times), statistics.median(times), len(points)


def ours(file, runs):
    program = ROOT / "target/release/examples/time_features"
    line = subprocess.run([program, str(runs), file], check=True, capture_output=True, text=True).stdout.split()
    return float(line[0]), float(line[1]), int(line[2])


def main():
    parser = argparse.ArgumentParser()
    default = os.environ.get("YFSLAM_DATA", ROOT.parent / "shared/data")
    parser.add_argument("data", nargs="?", type=pathlib.Path, default=pathlib.Path(default))
    parser.add_argument("--runs", type=int, default=100)
    args = parser.parse_args()
    subprocess.run(["cargo", "build", "--release", "-q", "-p", "yfslam", "--example", "time_features"], check=True, cwd=ROOT)
    cv2.setNumThreads(1)
    print("| image | OpenCV ORB min / median, ms | yfslam min / median, ms | ratio of minima |\n|---|---|---|---|")
    for name in ("tum_fr1_xyz_dev", "bonn_crowd_dev"):
        files = sorted((args.data / "rgbd" / name / "rgb").iterdir())
        for file in (files[0], files[len(files) // 2]):
            image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
            with tempfile.TemporaryDirectory() as folder:
                pgm = pathlib.Path(folder) / "image.pgm"
                cv2.imwrite(str(pgm), image)
                rounds = [(opencv(image, args.runs), ours(pgm, args.runs)) for _ in range(3)]
            theirs, mine = [[min(r[side][i] for r in rounds) for i in (0, 1)] for side in (0, 1)]
            print(f"| {name}/{file.name} | {theirs[0]:.2f} / {theirs[1]:.2f} | {mine[0]:.2f} / {mine[1]:.2f} | "
                  f"{mine[0] / theirs[0]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
