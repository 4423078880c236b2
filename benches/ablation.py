#!/usr/bin/env python3
"""What each part of method `full` is worth: the absolute trajectory error without it.

python3 benches/ablation.py [DATA_FOLDER] [--seeds 3] [--frames 150]        (cargo build --release first)

Synthetic worlds: median over seeds, boxes from the renderer. Recordings, where they are there: whole, boxes from the embedded network.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORLDS = ["walking_xyz", "walking_rpy", "pushed_chair", "carried_box", "crowd"]
RECORDINGS = ["tum_fr1_xyz_dev", "bonn_crowd_dev"]
PARTS = {
    "whole": "",
    "tracks are not carried over misses": "max_misses = 0",
    "no comparison with earlier views": "views = 1",
    "bodies end at gaps in depth": "max_gap_cells = 0",
    "corners on outlines are kept": "edge_px = 0.0",
    "landmarks that are seen through stay": "through_m = 100.0",
    "boxes are never doubted": "doubted_trust = 0.0",
    "nothing returns when features run short": "-",
}


def run(sequence, part, groundtruth=None):
    with tempfile.TemporaryDirectory() as out:
        config = pathlib.Path(out) / "part.toml"
        config.write_text("[dynamic]\nmin_trusted = 0\n" if part == "-" else f"[dynamic]\nmax_misses = 0\n[dynamic.full]\n{part}\n"
                          if "max_misses" in part else f"[dynamic.full]\n{part}\n")
        command = [ROOT / "target/release/yfslam", "run", sequence, "--method", "full", "--config", config, "--quiet",
                   "--out", pathlib.Path(out) / "run"]
        command += ["--groundtruth", groundtruth, "--detector", "embedded"] if groundtruth else []
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        record = json.loads((pathlib.Path(out) / "run/run.json").read_text())
    return record["evaluation"]["ate"]["translation_m"]["rmse"], record["frames"]["read"] - record["frames"]["tracked"]


def main():
    parser = argparse.ArgumentParser()
    default = os.environ.get("YFSLAM_DATA", ROOT.parent / "shared/data")
    parser.add_argument("data", nargs="?", type=pathlib.Path, default=pathlib.Path(default))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=150)
    args = parser.parse_args()
    recordings = [args.data / "rgbd" / name for name in RECORDINGS]
    recordings = [folder for folder in recordings if folder.is_dir()]
    names = WORLDS + [folder.name for folder in recordings]
    print("| ATE, m (frames lost) | " + " | ".join(names) + " |")
    print("|---" * (len(names) + 1) + "|")
    for name, part in PARTS.items():
        cells = []
        for world in WORLDS:
            runs = [run(f"synth:{world}?seed={seed}&frames={args.frames}", part) for seed in range(1, args.seeds + 1)]
            cells.append((statistics.median(ate for ate, _ in runs), sum(lost for _, lost in runs)))
        cells += [run(folder, part, folder / "groundtruth.txt") for folder in recordings]
        print(f"| {name} | " + " | ".join(f"{ate:.4f}" + (f" ({lost})" if lost else "") for ate, lost in cells) + " |", flush=True)


if __name__ == "__main__":
    main()
