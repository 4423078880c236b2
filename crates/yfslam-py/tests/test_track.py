"""Frames in, poses out: arrays of all kinds, errors, states."""

import gc
import threading
import time

import numpy as np
import pytest

import yfslam


def track_all(slam, frames):
    return [slam.track(frame.frame) for frame in frames]


def test_the_first_frames_give_poses_near_the_truth(world, frames):
    slam = yfslam.Slam(world.camera)
    tracked = track_all(slam, frames)
    assert all(tracked), [t.reason for t in tracked]
    assert tracked[0].state == "tracking" and tracked[0].pose.shape == (4, 4) and tracked[5].covariance.shape == (6, 6)
    assert tracked[0].is_keyframe and tracked[5].inliers > 50
    found = slam.finish()
    assert len(found) == len(frames) and found.tum().shape == (len(frames), 8)
    errors = yfslam.evaluate(world.truth(), found)
    assert errors.ate_m.rmse < 0.02 and errors.matches == len(frames)


def test_arrays_and_frames_give_the_same_bits(world, frames):
    by_frame, by_arrays = yfslam.Slam(world.camera), yfslam.Slam(world.camera)
    for frame in frames:
        f = frame.frame
        by_frame.track(f)
        by_arrays.track(
            f.timestamp_ns,
            f.rgb,
            f.depth,
            depth_scale=f.depth_scale,
            depth_timestamp_ns=f.depth_timestamp_ns,
            detections=f.detections,
        )
    assert by_frame.finish().poses.tobytes() == by_arrays.finish().poses.tobytes()


def test_strides_do_not_change_the_result(world, frames):
    """Views with gaps, in reverse, and in Fortran's order are the same images."""

    def run(change):
        slam = yfslam.Slam(world.camera, detector=None)
        for frame in frames[:6]:
            slam.track(frame.timestamp_ns, change(frame.rgb), change(frame.frame.depth))
        return slam.finish().poses.tobytes()

    def with_gaps(image):
        wide = np.zeros((image.shape[0], 2 * image.shape[1], *image.shape[2:]), image.dtype)
        wide[:, ::2] = image
        return wide[:, ::2]

    expected = run(lambda image: image)
    assert run(with_gaps) == expected
    assert run(lambda image: image[::-1].copy()[::-1]) == expected
    assert run(np.asfortranarray) == expected


def test_metres_and_grey_images_are_taken(world, frames):
    slam = yfslam.Slam(world.camera, detector=None)
    for frame in frames[:6]:
        grey = frame.rgb[:, :, 1].copy()
        boxes = frame.frame.detections
        assert slam.track(frame.timestamp_ns, grey, frame.frame.depth_m, detections=boxes).is_tracking
    truth = world.truth()
    assert np.linalg.norm(slam.finish().positions[5] - (np.linalg.inv(truth.poses[0]) @ truth.poses[5])[:3, 3]) < 0.02


@pytest.mark.parametrize(
    ("rgb", "depth", "error", "text"),
    [
        (np.zeros((240, 320, 3), np.float32), None, TypeError, "rgb has dtype float32, but must be uint8"),
        (np.zeros((240, 320, 4), np.uint8), None, ValueError, r"rgb has shape \[240, 320, 4\]"),
        (np.zeros((0, 320, 3), np.uint8), None, ValueError, "rgb has shape"),
        (np.zeros(5, np.uint8), None, ValueError, "rgb has shape"),
        ([[1, 2]], None, TypeError, "rgb is list, but must be a numpy array"),
        (None, np.zeros((240, 320), np.float64), TypeError, "depth has dtype float64"),
        (None, np.zeros((240, 320), ">u2"), TypeError, "depth has dtype"),
        (None, np.zeros((240, 320, 1), np.uint16), ValueError, "depth has shape"),
        (np.zeros((24, 32, 3), np.uint8), np.zeros((24, 32), np.uint16), yfslam.FrameRejected, "24"),
        (None, np.zeros((24, 32), np.uint16), yfslam.FrameRejected, "depth image is 32x24"),
    ],
)
def test_wrong_arrays_are_refused_and_the_system_goes_on(world, frames, rgb, depth, error, text):
    slam = yfslam.Slam(world.camera, detector=None)
    good = frames[0]
    with pytest.raises(error, match=text):
        slam.track(0, good.rgb if rgb is None else rgb, good.frame.depth if depth is None else depth)
    assert slam.track(good.frame)


def test_depth_of_16_bits_needs_a_unit(frames):
    camera = yfslam.Camera(320, 240, 267.0, 267.0, 159.5, 119.5)
    with pytest.raises(ValueError, match="depth_scale"):
        yfslam.Slam(camera).track(0, frames[0].rgb, frames[0].frame.depth)
    with pytest.raises(ValueError, match="depth_scale is -1"):
        yfslam.Slam(camera, depth_scale=-1.0).track(0, frames[0].rgb, frames[0].frame.depth)
    slam = yfslam.Slam(camera, depth_scale=frames[0].frame.depth_scale, detector=None)
    assert slam.track(0, frames[0].rgb, frames[0].frame.depth)


def test_time_must_ascend_and_depth_must_be_there(world, frames):
    slam = yfslam.Slam(world.camera, detector=None)
    slam.track(frames[0].frame)
    with pytest.raises(yfslam.FrameRejected, match="time stamp"):
        slam.track(frames[0].frame)
    with pytest.raises(yfslam.FrameRejected, match="no depth image"):
        slam.track(10**9, frames[1].rgb)
    with pytest.raises(TypeError, match="track"):
        slam.track(frames[0].frame, frames[0].rgb)


def test_a_black_image_says_why_there_is_no_pose(world):
    tracked = yfslam.Slam(world.camera).track(0, np.zeros((240, 320, 3), np.uint8), np.ones((240, 320), np.float32))
    assert not tracked and tracked.state == "not initialised" and tracked.pose is None and tracked.covariance is None
    assert "features" in tracked.reason and "features" in repr(tracked)


def test_a_function_is_a_detector(world, frames):
    calls = []

    def detector(image):
        calls.append(image.shape)
        boxes = np.array([[0, 0, 100, 240, 0.9, 0]], np.float32)
        return boxes, np.ones((240, 320), np.uint8)

    slam = yfslam.Slam(world.camera, detector=detector, method="boxes")
    for frame in frames[:5]:
        slam.track(frame.timestamp_ns, frame.rgb, frame.frame.depth)
    assert calls == [(240, 320, 3)] * 5
    assert slam.detections().shape == (1, 6)
    features = slam.features()
    assert (features.trust[features.pixels[:, 0] < 95] == 0).all() and (features.trust > 0).any()


def test_a_detector_that_fails_is_counted_and_reported(world, frames, caplog):
    def detector(image):
        raise RuntimeError("no network today")

    slam = yfslam.Slam(world.camera, detector=detector)
    with caplog.at_level("WARNING", logger="yfslam"):
        assert slam.track(frames[0].timestamp_ns, frames[0].rgb, frames[0].frame.depth)
    assert slam.statistics["detector_failures"] == 1
    assert "no network today" in caplog.text


def test_state_changes_go_to_logging(world, frames, caplog):
    with caplog.at_level("INFO", logger="yfslam"):
        slam = yfslam.Slam(world.camera)
        slam.track(frames[0].frame)
    assert "not initialised → tracking" in caplog.text


def test_other_threads_go_on_while_a_frame_is_tracked(world, frames):
    """The interpreter's lock is released: a thread of Python counts while frames are tracked."""
    counted, done = [], threading.Event()

    def count():
        while not done.is_set():
            counted.append(time.perf_counter())
            time.sleep(0.0005)

    slam = yfslam.Slam(world.camera)
    thread = threading.Thread(target=count)
    thread.start()
    started = time.perf_counter()
    for frame in frames[:8]:
        slam.track(frame.frame)
    ended = time.perf_counter()
    done.set()
    thread.join()
    during = [t for t in counted if started < t < ended]
    # With the lock held throughout, there would be no more than about one count between two calls.
    assert len(during) > 3 * 8


def test_one_system_serves_several_threads(world, frames):
    slam = yfslam.Slam(world.camera, threaded=True)
    threads = [threading.Thread(target=lambda: [slam.landmarks() for _ in range(30)]) for _ in range(3)]
    for thread in threads:
        thread.start()
    for frame in frames[:8]:
        slam.track(frame.frame)
    for thread in threads:
        thread.join()
    assert len(slam.landmarks().positions) > 100


def test_a_system_ends_while_its_detector_in_python_works(world, frames):
    """The thread of the detector needs the interpreter's lock to end, and the destructor waits for the thread."""

    def slow(image):
        time.sleep(0.2)
        return []

    slam = yfslam.Slam(world.camera, detector=slow, threaded=True, config={"dynamic": {"detect_async": True}})
    slam.track(frames[0].timestamp_ns, frames[0].rgb, frames[0].frame.depth)
    del slam
    gc.collect()
    with yfslam.Slam(world.camera) as slam:
        slam.track(frames[0].frame)
    with pytest.raises(yfslam.Error, match="closed"):
        slam.track(frames[1].frame)


def test_settings_by_dictionary_and_file(tmp_path, world, frames):
    path = tmp_path / "config.toml"
    path.write_text("features.count = 300\n")
    for config in (path, str(path), {"features": {"count": 300}}):
        slam = yfslam.Slam(world.camera, config=config, method="none")
        slam.track(frames[0].frame)
        assert 0 < len(slam.features().pixels) <= 400
    with pytest.raises(yfslam.Error, match="contrast"):
        yfslam.Slam(world.camera, config={"features": {"contrast": 1}})
    with pytest.raises(yfslam.Error, match="unknown method 'best'"):
        yfslam.Slam(world.camera, method="best")
    with pytest.raises(yfslam.Error, match="nowhere"):
        yfslam.Slam(world.camera, detector="/nowhere.onnx")
    assert "features.count" in yfslam.default_config_toml()
