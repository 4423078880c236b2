"""What is logged to Rerun is written to a file that Rerun's own reader understands."""

import subprocess
import sys

import pytest

import yfslam

rerun = pytest.importorskip("rerun", reason="pip install rerun-sdk")

from yfslam.rerun import Log  # noqa: E402


def test_a_run_is_logged(tmp_path, world, frames):
    path = tmp_path / "run.rrd"
    log = Log(world.camera, save=str(path), map_every=4)
    slam = yfslam.Slam(world.camera, dense=True)
    for frame in frames[:8]:
        log.frame(slam, frame.frame, slam.track(frame.frame))
    log.map(slam)
    log.dense(slam)
    del log
    checked = subprocess.run([sys.executable, "-m", "rerun", "rrd", "print", str(path)], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr
    for entity in ("/world/camera/image/features", "/world/path", "/world/landmarks", "/world/cloud", "/plots/inliers"):
        assert entity in checked.stdout, entity
