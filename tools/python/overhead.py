"""Processor time of the Python way divided by that of the program, on one recording, in pairs.

    python tools/python/overhead.py target/release/yfslam RECORDING CAMERA [PAIRS [frames|arrays]]

In a pair, the program and a process of Python that tracks the same frames run one after the other, the order changes from pair to pair.
Printed are the medians of user and system time, and the median, least and greatest ratio of the pairs.
"""

from __future__ import annotations

import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

FRAMES = """
import sys, yfslam
recording = yfslam.open(sys.argv[1], camera=sys.argv[2])
slam = yfslam.Slam(recording.camera)
for frame in recording:
    slam.track(frame)
slam.finish().save(sys.argv[3])
"""
ARRAYS = """
import sys, yfslam
recording = yfslam.open(sys.argv[1], camera=sys.argv[2])
slam = yfslam.Slam(recording.camera)
for frame in recording:
    tracked = slam.track(frame.timestamp_ns, frame.rgb, frame.depth, depth_timestamp_ns=frame.depth_timestamp_ns)
    pose, covariance = tracked.pose, tracked.covariance
slam.finish().save(sys.argv[3])
"""


def seconds(command: list[str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    program, recording, camera, pairs = (*sys.argv[1:4], int(sys.argv[4]) if len(sys.argv) > 4 else 5)
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = os.path.join(folder, "trajectory.txt"), os.path.join(folder, "run")
        run = [program, "run", recording, "--camera", camera, "-q", "-o", theirs]
        for name, code in (("frames", FRAMES), ("arrays", ARRAYS)):
            if len(sys.argv) > 5 and name != sys.argv[5]:
                continue
            python = [sys.executable, "-c", code, recording, camera, ours]
            times = []
            for pair in range(pairs):
                order = [python, run] if pair % 2 else [run, python]
                took = {id(command): seconds(command) for command in order}
                times.append((took[id(python)], took[id(run)]))
            same = pathlib.Path(ours).read_bytes() == (pathlib.Path(theirs) / "trajectory.txt").read_bytes()
            ratios = sorted(a / b for a, b in times)
            python_s, program_s = (statistics.median(column) for column in zip(*times))
            print(
                f"{name}: Python {python_s:.2f} s, program {program_s:.2f} s, ratio {statistics.median(ratios):.3f} "
                f"({ratios[0]:.3f} to {ratios[-1]:.3f}), {pairs} pairs; trajectories {'equal' if same else 'DIFFERENT'}"
            )


if __name__ == "__main__":
    main()
