"""Recordings, worlds, trajectories, cameras, and the program."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

import yfslam
from conftest import SPEC


def program(*arguments, **options):
    command = [sys.executable, "-m", "yfslam", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, **options)


def run_in_python(path, out, **options):
    recording = yfslam.open(path, **options)
    slam = yfslam.Slam(recording.camera)
    for frame in recording:
        slam.track(frame)
    slam.finish().save(out)


def test_a_world_gives_the_trajectory_of_the_program(tmp_path):
    run_in_python(SPEC, tmp_path / "python.txt")
    done = program("run", SPEC, "-q", "-o", tmp_path / "program")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "python.txt").read_bytes() == (tmp_path / "program" / "trajectory.txt").read_bytes()


@pytest.mark.parametrize(("name", "camera"), [("bonn_crowd_dev", "bonn"), ("tum_fr1_xyz_dev", "tum1")])
def test_a_recording_gives_the_trajectory_of_the_program(data, tmp_path, name, camera):
    path = data / "rgbd" / name
    run_in_python(path, tmp_path / "python.txt", camera=camera, end=200)
    done = program("run", path, "--camera", camera, "--end", 200, "-q", "-o", tmp_path / "program")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "python.txt").read_bytes() == (tmp_path / "program" / "trajectory.txt").read_bytes()


def test_a_folder_is_read_twice_and_part_of_it_backward(tmp_path):
    folder = tmp_path / "world"
    assert program("synth", SPEC, "-q", "-o", folder).returncode == 0
    recording = yfslam.open(folder, start=2, end=8)
    assert len(recording) == 6 and recording.sensor == "rgbd" and recording.camera.width == 320
    first, second = [[f.timestamp_ns for f in recording] for _ in range(2)]
    assert first == second == recording.timestamps_ns.tolist()
    backward = list(yfslam.open(folder, start=2, end=8, reverse=True))
    assert backward[0].rgb.tobytes() == list(recording)[-1].rgb.tobytes()
    truth = recording.truth()
    assert truth is not None and len(truth) > 6
    with pytest.raises(yfslam.Error, match="nowhere"):
        yfslam.open("/nowhere")


def test_frames_that_cannot_be_read_are_left_out_with_a_warning(tmp_path, caplog):
    folder = tmp_path / "world"
    assert program("synth", SPEC, "-q", "-o", folder).returncode == 0
    images = sorted((folder / "rgb").iterdir())
    images[10].write_bytes(b"no image")
    frames = iter(yfslam.open(folder))
    with caplog.at_level("WARNING", logger="yfslam"):
        assert len(list(frames)) == 23
    assert len(frames.skipped) == 1 and images[10].name in caplog.text


def test_a_world_has_exact_truth(world, frames):
    frame = frames[4]
    again = world[4]
    assert again.rgb.tobytes() == frame.rgb.tobytes() and world[-1].timestamp_ns == frames[-1].timestamp_ns
    with pytest.raises(IndexError):
        world[len(world)]
    assert np.allclose(world.truth().poses[4], frame.pose)
    assert frame.instances.shape == frame.exact_depth_m.shape == (240, 320)
    for box, instance in zip(frame.boxes, frame.box_instances):
        rows, columns = np.nonzero(frame.instances == instance)
        assert np.allclose(box, [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1])
    assert "walking_xyz" in dict(yfslam.worlds()) and "person" in yfslam.World.class_names
    with pytest.raises(yfslam.Error, match="colour_of_socks"):
        yfslam.World("walking_xyz?colour_of_socks=1")


def test_a_known_motion_is_evaluated_and_aligned(tmp_path):
    stamps = np.arange(40, dtype=np.int64) * 50_000_000
    poses = np.tile(np.eye(4), (40, 1, 1))
    s = np.linspace(0, 3, 40)
    poses[:, :3, 3] = np.stack([np.sin(s), np.cos(s), 0.1 * s], axis=1)
    truth = yfslam.Trajectory(stamps, poses)
    turn = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], float)
    moved = yfslam.Trajectory(stamps, turn @ poses)
    errors = yfslam.evaluate(truth, moved, expected_ns=stamps)
    assert errors.ate_m.rmse < 1e-9 and errors.tracked_fraction == 1.0 and errors.rpe_frame[0].rmse < 1e-9
    assert np.allclose(errors.alignment.matrix, np.linalg.inv(turn))
    alignment, aligned = yfslam.align(truth, moved)
    assert np.allclose(aligned.poses, poses) and alignment.scale == 1.0
    moved.save(tmp_path / "moved.txt")
    again = yfslam.load_trajectory(tmp_path / "moved.txt")
    assert np.allclose(again.poses, moved.poses, atol=1e-6) and (again.timestamps_ns == stamps).all()
    assert np.allclose(np.loadtxt(tmp_path / "moved.txt"), moved.tum(), atol=1e-6)
    with pytest.raises(ValueError, match="no rigid motion"):
        yfslam.Trajectory(stamps[:1], np.zeros((1, 4, 4)))
    with pytest.raises(yfslam.Error, match="unknown alignment"):
        yfslam.evaluate(truth, moved, alignment="best")


def test_cameras(tmp_path):
    bonn = yfslam.Camera.load("bonn")
    assert "bonn" in yfslam.presets() and bonn.width == 640 and abs(bonn.depth_scale - 1 / 5000) < 1e-12
    assert np.allclose(bonn.matrix[0], [bonn.fx, 0, bonn.cx])
    bonn.save(tmp_path / "camera.toml")
    again = yfslam.Camera.load(tmp_path / "camera.toml")
    assert again.distortion == bonn.distortion and again.depth_scale == bonn.depth_scale
    with pytest.raises(yfslam.Error, match="neither a file nor a preset"):
        yfslam.Slam("no_such_camera")
    with pytest.raises(ValueError, match="distortion has 3 values"):
        yfslam.Camera(640, 480, 500, 500, 320, 240, distortion=[1, 2, 3])
    with pytest.raises(yfslam.Error):
        yfslam.Camera(640, 480, -1, 500, 320, 240)


def test_the_program_is_installed():
    done = program("--version")
    assert done.returncode == 0 and done.stdout.startswith("yfslam 0")
    script = os.path.join(os.path.dirname(sys.executable), "yfslam")
    assert "dynamic.method" in subprocess.run([script, "config"], capture_output=True, text=True).stdout
    wrong = program("run", "/nowhere")
    assert wrong.returncode == 1 and "nowhere" in wrong.stderr


def test_the_program_starts_itself_again(tmp_path):
    spec = SPEC.replace("frames=24", "frames=6")
    for out, command in (("a", [sys.executable, "-m", "yfslam"]), ("b", [os.path.join(os.path.dirname(sys.executable), "yfslam")])):
        done = subprocess.run(
            [*command, "bench", spec, "--methods", "none", "-q", "-o", str(tmp_path / out)], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        assert list((tmp_path / out / "cells").iterdir())


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_ends_a_loop():
    code = textwrap.dedent(
        f"""
        import yfslam
        world = yfslam.World({SPEC!r})
        slam = yfslam.Slam(world.camera)
        print("ready", flush=True)
        try:
            for number in range(10**9):
                slam.track(number * 10**8, world[number % 20].rgb, world[number % 20].frame.depth)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        """
    )
    # A test that runs in the background of a shell has inherited that Ctrl-C is ignored.
    child = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        assert child.communicate(timeout=60)[0] == "interrupted\n" and child.returncode == 0
    finally:
        child.kill()
