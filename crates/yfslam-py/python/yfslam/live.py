"""SLAM with a live camera: ``python -m yfslam.live realsense``.

Also as a library::

    from yfslam.live import RealSense

    with RealSense() as camera:
        slam = yfslam.Slam(camera.camera, threaded=True)
        for frame in camera:
            tracked = slam.track(frame)

A camera gives frames that ``Slam.track`` takes: depth aligned to colour, in its own units, without frames that were delivered before. The
filter that fills holes in the depth stays off: what was not measured must not look as if it was.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Optional

import numpy as np

import yfslam

# Time without frames after which a camera counts as lost, ms.
PATIENCE_MS = 5000


def _sdk() -> Any:
    try:
        import pyrealsense2
    except ImportError as error:
        raise yfslam.Error("pyrealsense2 is not installed; install it with: pip install 'yfslam[realsense]'") from error
    return pyrealsense2


def camera_of(intrinsics: Any, *, fps: float = 30.0, depth_scale: Optional[float] = None) -> yfslam.Camera:
    """Return the camera of the intrinsics of a video stream of librealsense."""
    rs = _sdk()
    coefficients = [float(c) for c in intrinsics.coeffs]
    if any(coefficients) and intrinsics.model not in (rs.distortion.brown_conrady, rs.distortion.modified_brown_conrady):
        # The inverse model undistorts; librealsense gives coefficients that are zero for the cameras that use it.
        raise yfslam.Error(f"the lens model {intrinsics.model} is not supported; calibrate the camera and give Slam a yfslam.Camera")
    return yfslam.Camera(
        intrinsics.width,
        intrinsics.height,
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.ppx,
        intrinsics.ppy,
        distortion=coefficients if any(coefficients) else (),
        fps=fps,
        depth_scale=depth_scale,
    )


class RealSense:
    """A RealSense camera, or a recording of one (``.bag`` or ``.db3`` of the SDK) as ``file``.

    Iterating gives frames until the camera is lost or the recording ends.
    """

    def __init__(
        self,
        file: Optional[str] = None,
        *,
        width: int = 640,
        height: int = 480,
        fps: int = 30,
        serial: Optional[str] = None,
        context: Any = None,
    ) -> None:
        rs = _sdk()
        self._pipeline = rs.pipeline(context) if context is not None else rs.pipeline()
        config = rs.config()
        if file is not None:
            config.enable_device_from_file(str(file), repeat_playback=False)
        else:
            if serial is not None:
                config.enable_device(serial)
            config.enable_stream(rs.stream.color, width, height, rs.format.rgb8, fps)
            config.enable_stream(rs.stream.depth, width, height, rs.format.z16, fps)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            source = file or "a RealSense camera"
            raise yfslam.Error(f"{source} cannot be opened: {error}; check cable, udev rules and that no other program uses it") from error
        device = profile.get_device()
        self._playback = None
        if file is not None:
            self._playback = device.as_playback()
            # Every frame is delivered, however long it takes to track it.
            self._playback.set_real_time(False)
        stream = profile.get_stream(rs.stream.color).as_video_stream_profile()
        self._align = rs.align(rs.stream.color)
        self._last = -1
        self._last_ns = -1
        self.repeated = 0
        """Frames that were delivered twice and left out."""
        self.lost: Optional[str] = None
        """Why there are no more frames of a camera; None before that, and at the end of a recording."""
        self.camera = camera_of(stream.get_intrinsics(), fps=float(stream.fps()), depth_scale=self._scale(device))

    @staticmethod
    def _scale(device: Any) -> float:
        for sensor in device.query_sensors():
            if sensor.is_depth_sensor():
                return float(sensor.as_depth_sensor().get_depth_scale())
        raise yfslam.Error("the camera has no depth sensor; use one with depth, such as a D435")

    def __iter__(self) -> Iterator[yfslam.Frame]:
        while True:
            found, frames = self._pipeline.try_wait_for_frames(PATIENCE_MS if self._playback is None else 1000)
            if not found:
                if self._playback is None:
                    self.lost = f"no frame came within {PATIENCE_MS / 1000:.0f} s; check the cable"
                return
            aligned = self._align.process(frames)
            color, depth = aligned.get_color_frame(), aligned.get_depth_frame()
            if not color or not depth:
                continue
            frame = self._frame(color, depth)
            if frame is not None:
                yield frame

    def _frame(self, color: Any, depth: Any) -> Optional[yfslam.Frame]:
        rs = _sdk()
        number, stamp_ns = color.get_frame_number(), round(color.get_timestamp() * 1e6)
        # The pipeline pairs a colour image again where the next one is missing.
        if number == self._last or stamp_ns <= self._last_ns:
            self.repeated += 1
            return None
        self._last, self._last_ns = number, stamp_ns
        pixels = np.asanyarray(color.get_data())
        kind = color.get_profile().format()
        if kind == rs.format.bgr8:
            pixels = pixels[:, :, ::-1]
        elif kind not in (rs.format.rgb8, rs.format.y8):
            raise yfslam.Error(f"colour images of format {kind} are not supported; record rgb8 or bgr8")
        return yfslam.Frame(
            stamp_ns,
            pixels,
            np.asanyarray(depth.get_data()),
            depth_scale=self.camera.depth_scale,
            depth_timestamp_ns=round(depth.get_timestamp() * 1e6),
        )

    def close(self) -> None:
        """Stop the camera."""
        self._pipeline.stop()

    def __enter__(self) -> RealSense:
        return self

    def __exit__(
        self,
        kind: Optional[type[BaseException]],
        error: Optional[BaseException],
        traceback: Optional[TracebackType],
    ) -> None:
        self.close()


def _arguments(arguments: Optional[list[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m yfslam.live", description="SLAM with a live camera, or with a recording of its SDK.")
    parser.add_argument("camera", choices=["realsense"], help="kind of the camera")
    parser.add_argument("--file", help="recording of the SDK (.bag or .db3) in place of a camera")
    parser.add_argument("--serial", help="serial number, where there are several cameras")
    parser.add_argument("--size", default="640x480", metavar="WxH", help="size of the images [default: 640x480]")
    parser.add_argument("--fps", type=int, default=30, help="images per second [default: 30]")
    parser.add_argument("--method", default=None, help="method for dynamic scenes [default: full]")
    parser.add_argument("--frames", type=int, default=None, help="frames after which the run ends [default: until Ctrl-C]")
    parser.add_argument("--map", default=None, help="saved map in which the camera is localised and that is extended")
    parser.add_argument("--save-map", default=None, metavar="FILE", help="file to which the map is saved at the end")
    parser.add_argument("-o", "--out", default="trajectory.txt", help="file of the trajectory [default: trajectory.txt]")
    parser.add_argument("--rerun", action="store_true", help="show everything in the Rerun viewer (pip install 'yfslam[rerun]')")
    return parser.parse_args(arguments)


def main(arguments: Optional[list[str]] = None) -> int:
    """Track until Ctrl-C, the end of the recording or the loss of the camera, and save the trajectory."""
    options = _arguments(arguments)
    width, _, height = options.size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        print(f"--size is '{options.size}'; give width and height, such as 640x480", file=sys.stderr)
        return 2
    try:
        source = RealSense(options.file, width=int(width), height=int(height), fps=options.fps, serial=options.serial)
    except yfslam.Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    log = None
    if options.rerun:
        from yfslam.rerun import Log

        log = Log(source.camera, spawn=True)
    # With a recording there is no hurry, and the same input gives the same bits.
    threaded = options.file is None
    slam = yfslam.Slam(source.camera, method=options.method, map=options.map, threaded=threaded)
    tracked_frames = frames = 0
    state, started = "", time.monotonic()
    try:
        with source:
            for frame in source:
                tracked = slam.track(frame)
                frames += 1
                tracked_frames += tracked.is_tracking
                if log is not None:
                    log.frame(slam, frame, tracked)
                if tracked.state != state:
                    state = tracked.state
                    print(f"{state}{': ' + tracked.reason if tracked.reason else ''}", flush=True)
                if frames == options.frames:
                    break
    except KeyboardInterrupt:
        pass
    trajectory = slam.finish()
    if len(trajectory) > 0:
        trajectory.save(options.out)
    if options.save_map is not None and len(trajectory) > 0:
        slam.save_map(options.save_map)
    seconds = max(time.monotonic() - started, 1e-9)
    print(f"{tracked_frames} of {frames} frames tracked, {source.repeated} repeated frames left out, {frames / seconds:.1f} frames/s")
    if source.lost is not None:
        print(f"error: the camera was lost: {source.lost}", file=sys.stderr)
        return 1
    if len(trajectory) == 0:
        print("error: no frame was tracked, and nothing was written", file=sys.stderr)
        return 1
    print(f"written to {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
