#!/usr/bin/env python3
"""Times a whole frame (features + dynamic filter + tracking, and mapping beside it) as multiples of OpenCV's ORB on the same images.

python3 crates/yfslam-bench/peers/peers_tracking.py [DATA_FOLDER]        (pip: opencv-python-headless; cargo build --release first)

Rounds of both alternate, so that both see the same load; each figure is the least median of the rounds, in ms. OpenCV runs
ORB_create(1000).detectAndCompute on one thread, on every tenth grey image; ours are the stage times of `yfslam run`.
"""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import cv2

ROOT = pathlib.Path(__file__).resolve().parents[3]
DATA = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("YFSLAM_DATA", ROOT.parent / "shared/data"))
ROUNDS = 3
STAGES = ("features", "dynamic_filter", "tracking")


def opencv(images):
    orb, times = cv2.ORB_create(1000), []
    for image in images:
        start = time.perf_counter()
        orb.detectAndCompute(image, None)
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times)


def ours(sequence):
    with tempfile.TemporaryDirectory() as out:
        subprocess.run(
            [ROOT / "target/release/yfslam", "run", sequence, "--out", out, "--quiet",
             "--detector", DATA / "models/yolo-fastestv2-coco.onnx"],
            check=True, stdout=subprocess.DEVNULL)
        run = json.loads((pathlib.Path(out) / "run.json").read_text())
    times = {stage: run["times"][stage]["median_ms"] for stage in STAGES}
    mapping = run["times"]["mapping"]
    times["mapping, per keyframe"] = mapping["median_ms"]
    return times


def main():
    cv2.setNumThreads(1)
    for name in ("tum_fr1_xyz_dev", "bonn_crowd_dev"):
        sequence = DATA / "rgbd" / name
        files = sorted((sequence / "rgb").iterdir())[::10]
        images = [cv2.imread(str(f), cv2.IMREAD_GRAYSCALE) for f in files]
        rounds = [(opencv(images), ours(sequence)) for _ in range(ROUNDS)]
        orb = min(r[0] for r in rounds)
        print(f"{name}: OpenCV ORB {orb:.2f} ms")
        best = {stage: min(r[1][stage] for r in rounds) for stage in rounds[0][1]}
        for stage, ms in best.items():
            print(f"  {stage:24} {ms:6.2f} ms  {ms / orb:5.2f} x")
        total = sum(best[stage] for stage in STAGES)
        print(f"  {'features+filter+tracking':24} {total:6.2f} ms  {total / orb:5.2f} x")


if __name__ == "__main__":
    main()
