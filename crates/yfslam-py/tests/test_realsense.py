"""The way from a RealSense camera to poses, through the SDK's own recording and playback."""

import gc
import pathlib

import numpy as np
import pytest

import yfslam

rs = pytest.importorskip("pyrealsense2", reason="pip install pyrealsense2")

from software_camera import record  # noqa: E402
from yfslam.live import RealSense, camera_of, main  # noqa: E402


@pytest.fixture(scope="module")
def recording(tmp_path_factory, world, frames) -> pathlib.Path:
    path = tmp_path_factory.mktemp("realsense") / "world.db3"
    record(path, world, frames, repeated={7, 8})
    gc.collect()
    assert path.stat().st_size > 1_000_000
    return path


def test_playback_gives_the_frames_with_units_and_calibration(recording, world, frames):
    with RealSense(str(recording)) as camera:
        assert (camera.camera.width, camera.camera.height) == (320, 240)
        assert abs(camera.camera.fx - world.camera.fx) < 1e-3
        assert abs(camera.camera.depth_scale - frames[0].frame.depth_scale) < 1e-9
        played = list(camera)
    # Two colour images were delivered twice.
    assert len(played) >= len(frames) - 4 and camera.lost is None
    stamps = [frame.timestamp_ns for frame in played]
    assert stamps == sorted(set(stamps))
    known = {round(frame.timestamp_ns * 1e-6): frame for frame in frames}
    for frame in played:
        original = known[round(frame.timestamp_ns * 1e-6) - 1000]
        assert (frame.rgb == original.rgb).all()
        # Both cameras are at the same place, so alignment leaves nearly all depths where they are.
        if frame.depth_timestamp_ns == frame.timestamp_ns:
            assert np.mean(frame.depth == original.frame.depth) > 0.95


def test_the_command_writes_a_trajectory_near_the_truth(recording, world, tmp_path, capsys):
    out = tmp_path / "trajectory.txt"
    assert main(["realsense", "--file", str(recording), "-o", str(out), "--save-map", str(tmp_path / "room.map")]) == 0
    assert "frames tracked" in capsys.readouterr().out
    found = yfslam.load_trajectory(out)
    shifted = yfslam.Trajectory(found.timestamps_ns - 1_000_000_000, found.poses)
    errors = yfslam.evaluate(world.truth(), shifted)
    assert errors.matches >= 15 and errors.ate_m.rmse < 0.03
    assert len(yfslam.load_map(tmp_path / "room.map").landmarks().positions) > 100


def test_what_cannot_be_opened_is_named(capsys):
    assert main(["realsense", "--file", "/nowhere.db3"]) == 1
    assert "/nowhere.db3" in capsys.readouterr().err
    assert main(["realsense", "--size", "large"]) == 2


def test_a_lens_that_is_not_supported_is_refused():
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height, intrinsics.fx, intrinsics.fy = 640, 480, 600.0, 600.0
    intrinsics.ppx, intrinsics.ppy, intrinsics.coeffs = 320.0, 240.0, [0.1, 0, 0, 0, 0]
    intrinsics.model = rs.distortion.kannala_brandt4
    with pytest.raises(yfslam.Error, match="lens model"):
        camera_of(intrinsics)
    intrinsics.model = rs.distortion.brown_conrady
    assert camera_of(intrinsics).distortion[0] == pytest.approx(0.1)
