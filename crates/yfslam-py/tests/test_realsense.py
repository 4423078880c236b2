"""The way from a RealSense camera to poses, through the SDK's own recording and playback."""

import gc
import pathlib
from types import SimpleNamespace

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


def opened_without_a_camera() -> RealSense:
    camera = RealSense.__new__(RealSense)
    camera._playback, camera._last, camera._last_ns, camera.repeated, camera.lost = None, -1, -1, 0, None
    camera.camera = yfslam.Camera(64, 48, 60.0, 60.0, 31.5, 23.5, depth_scale=0.001)
    return camera


def test_the_loss_of_a_camera_ends_the_frames():
    camera = opened_without_a_camera()
    camera._pipeline = SimpleNamespace(try_wait_for_frames=lambda _: (False, None))
    assert list(camera) == [] and "cable" in camera.lost


def test_an_image_that_is_delivered_twice_is_left_out():
    def image(number, stamp_ms, pixels, kind=rs.format.rgb8):
        profile = SimpleNamespace(format=lambda: kind)
        return SimpleNamespace(
            get_frame_number=lambda: number,
            get_timestamp=lambda: stamp_ms,
            get_data=lambda: pixels,
            get_profile=lambda: profile,
        )

    camera = opened_without_a_camera()
    rgb, depth = np.zeros((48, 64, 3), np.uint8), np.zeros((48, 64), np.uint16)
    rgb[:, :, 0] = 200
    numbers = [(1, 0.0), (1, 0.0), (2, 33.0), (3, 33.0), (4, 66.0)]
    found = [camera._frame(image(number, stamp, rgb), image(number, stamp, depth)) for number, stamp in numbers]
    assert [frame is not None for frame in found] == [True, False, True, False, True] and camera.repeated == 2
    assert found[2].timestamp_ns == 33_000_000 and found[2].depth_scale == pytest.approx(0.001)
    # Blue, green, red become red, green, blue.
    bgr = camera._frame(image(5, 99.0, rgb[:, :, ::-1], rs.format.bgr8), image(5, 99.0, depth))
    assert (bgr.rgb == rgb).all()
    with pytest.raises(yfslam.Error, match="format"):
        camera._frame(image(6, 132.0, rgb, rs.format.yuyv), image(6, 132.0, depth))
