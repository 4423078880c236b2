"""Writes golden.csv: figures of the tool `evo` (pip install evo==1.38.1) for the trajectories of the golden test.

    python golden.py $YFSLAM_DATA/trajectories > golden.csv

Each row carries the command that made it, run in that folder, save for spans in seconds, which evo lacks: those are computed here
with numpy alone, from the definition in src/rpe.rs, on the poses that evo's own rule of association (nearest stamp) selects.
"""

import csv
import json
import subprocess
import sys
import tempfile
import zipfile
from decimal import Decimal
from pathlib import Path

import numpy as np

STATISTICS = ["rmse", "mean", "median", "std", "min", "max"]
KEYS = ["sequence", "metric", "max_diff_s", "unit", "delta", "pairs", "count", *STATISTICS, "command"]


def run_evo(folder, command):
    """Statistics and number of errors of an evo command."""
    with tempfile.TemporaryDirectory() as scratch:
        archive = Path(scratch) / "result.zip"
        subprocess.run([*command.split(), "--silent", "--save_results", str(archive)], cwd=folder, check=True)
        with zipfile.ZipFile(archive) as results:
            statistics = json.loads(results.read("stats.json"))
            with results.open("error_array.npy") as errors:
                return {**statistics, "count": len(np.load(errors))}


def poses(path):
    """Stamps in s and in whole ns, and 4x4 matrices, of a TUM trajectory."""
    rows = np.loadtxt(path)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    stamps_ns = [int(Decimal(line.split()[0]) * 10**9) for line in lines]
    x, y, z, w = (rows[:, 4:] / np.linalg.norm(rows[:, 4:], axis=1, keepdims=True)).T
    matrices = np.tile(np.eye(4), (len(rows), 1, 1))
    matrices[:, :3, 3] = rows[:, 1:4]
    matrices[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1)
    matrices[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1)
    matrices[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1)
    return rows[:, 0], np.array(stamps_ns), matrices


def per_seconds(reference, estimate, max_diff_s, delta_s, all_pairs):
    """Translation (m) and rotation (deg) errors of pairs delta_s apart, tolerance a twentieth of it."""
    (t_ref, _, q), (t, t_ns, p) = reference, estimate
    closest = [np.argmin(np.abs(t_ref - s)) for s in t]
    keep = [k for k, c in enumerate(closest) if abs(t_ref[c] - t[k]) <= max_diff_s]
    q, t_ns, p = q[[closest[k] for k in keep]], t_ns[keep], p[keep]
    delta_ns = round(delta_s * 1e9)
    translations, rotations, i = [], [], 0
    while i < len(p) - 1:
        j = i + 1 + np.argmin(np.abs(t_ns[i + 1 :] - (t_ns[i] + delta_ns)))
        found = abs(t_ns[j] - t_ns[i] - delta_ns) <= 0.05 * delta_ns
        if found:
            e = np.linalg.inv(np.linalg.inv(q[i]) @ q[j]) @ (np.linalg.inv(p[i]) @ p[j])
            translations.append(np.linalg.norm(e[:3, 3]))
            skew = [e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1]]
            rotations.append(np.degrees(np.arctan2(np.linalg.norm(skew), np.trace(e[:3, :3]) - 1)))
        i = j if found and not all_pairs else i + 1
    return {"trans_part": np.array(translations), "angle_deg": np.array(rotations)}


def describe(e):
    return {
        "count": len(e), "rmse": np.sqrt(np.mean(e**2)), "mean": np.mean(e), "median": np.median(e),
        "std": np.std(e), "min": np.min(e), "max": np.max(e),
    }  # fmt: skip


def rows(folder):
    for sequence in ["fr2_desk", "fr3_sitting_xyz"]:
        files = f"{sequence}_groundtruth.txt {sequence}_ORB.txt"
        key = {"sequence": sequence, "max_diff_s": 0.01}
        for max_diff_s in [0.01, 0.02]:
            for metric, flags in [("ate_se3", "-a"), ("ate_sim3", "-a -s")]:
                command = f"evo_ape tum {files} {flags} --t_max_diff {max_diff_s}"
                yield {**key, "metric": metric, "max_diff_s": max_diff_s, "command": command, **run_evo(folder, command)}
        for unit, delta in [("f", 1), ("f", 10), ("f", 30), ("m", 0.1), ("m", 0.5), ("m", 1)]:
            for pairs in ["consecutive", "all_pairs"]:
                for metric in ["trans_part", "angle_deg"]:
                    command = f"evo_rpe tum {files} -r {metric} -u {unit} -d {delta}"
                    command += " --all_pairs" if pairs == "all_pairs" else ""
                    result = run_evo(folder, command)
                    yield {**key, "metric": metric, "unit": unit, "delta": delta, "pairs": pairs, "command": command, **result}
        # A monocular estimate is scaled before it is compared.
        for unit, delta, pairs in [("f", 1, "consecutive"), ("m", 0.5, "consecutive"), ("m", 0.5, "all_pairs")]:
            command = f"evo_rpe tum {files} -as -u {unit} -d {delta}" + (" --all_pairs" if pairs == "all_pairs" else "")
            result = run_evo(folder, command)
            yield {**key, "metric": "trans_part_sim3", "unit": unit, "delta": delta, "pairs": pairs, "command": command, **result}
        reference, estimate = (poses(folder / file) for file in files.split())
        for delta in [0.1, 1, 2.5]:
            for pairs in ["consecutive", "all_pairs"]:
                for metric, errors in per_seconds(reference, estimate, 0.01, delta, pairs == "all_pairs").items():
                    yield {**key, "metric": metric, "unit": "s", "delta": delta, "pairs": pairs,
                           "command": "golden.py per_seconds", **describe(errors)}  # fmt: skip


if __name__ == "__main__":
    writer = csv.DictWriter(sys.stdout, KEYS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for row in rows(Path(sys.argv[1])):
        writer.writerow({k: f"{v:.12g}" if k in STATISTICS else v for k, v in row.items()})
