#!/usr/bin/env python3
"""Runs yfslam as a baseline of VSLAM-LAB, with the arguments that VSLAM-LAB gives to its baselines.

    python3 tools/vslam_lab.py --sequence_path DIR --rgb_csv FILE --calibration_yaml FILE --exp_folder DIR --exp_it 00000 --mode rgbd

Arguments may also be written as `key:value` or `key value`. The result is EXP_FOLDER/ID_KeyFrameTrajectory.csv; the other files of the run
are in EXP_FOLDER/ID_yfslam. The program `yfslam` must be in the PATH, or be named with `--yfslam FILE`. In VSLAM-LAB, the class of a baseline
sets its modes to mono, stereo and rgbd and its camera models to pinhole and radtan5, and the tasks execute-mono, execute-stereo and
execute-rgbd call this script.
"""

import os
import subprocess
import sys
from pathlib import Path


def arguments(words):
    """Returns the values by their keys, from `--key value`, `key value` or `key:value`."""
    values, words = {}, list(words)
    while words:
        key = words.pop(0)
        name, colon, value = key.lstrip("-").partition(":")
        if colon:
            values[name] = value
        elif words:
            values[name] = words.pop(0)
        else:
            sys.exit(f"{key} has no value")
    return values


def sequence_folder(given, folder):
    """Returns a folder with the list and the calibration of this run beside the images."""
    sequence = Path(given["sequence_path"]).resolve()
    own = {"rgb.csv": given.get("rgb_csv"), "calibration.yaml": given.get("calibration_yaml")}
    files = {name: Path(own[name]).resolve() if own[name] else sequence / name for name in own}
    if all(files[name] == sequence / name for name in files):
        return sequence
    folder.mkdir(parents=True, exist_ok=True)
    for entry in sequence.iterdir():
        files.setdefault(entry.name, entry)
    for name, target in files.items():
        link = folder / name
        link.unlink(missing_ok=True)
        os.symlink(target, link)
    return folder


def main():
    given = arguments(sys.argv[1:])
    missing = [key for key in ["sequence_path", "exp_folder", "mode"] if key not in given]
    run = given.get("exp_it", given.get("exp_id"))
    if missing or run is None:
        sys.exit(f"missing: {', '.join(missing + ['exp_it'] * (run is None))}\n\n{__doc__}")
    folder = Path(given["exp_folder"])
    sequence = sequence_folder(given, folder / f"{run}_yfslam_input")
    command = [given.get("yfslam", "yfslam"), "run", sequence, "--layout", "vslam-lab", "--sensor", given["mode"]]
    command += ["--out", folder / f"{run}_yfslam", "--vslam-lab", folder / run]
    if given.get("method"):
        command += ["--method", given["method"]]
    sys.exit(subprocess.run(command).returncode)


main()
