"""A recording of the RealSense SDK, made by its software device from frames of a synthetic world: no hardware."""

from __future__ import annotations

import pathlib
import time
from typing import Any

import numpy as np
import pyrealsense2 as rs

import yfslam

FPS = 30


def _intrinsics(camera: yfslam.Camera) -> Any:
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height = camera.width, camera.height
    intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy = camera.fx, camera.fy, camera.cx, camera.cy
    intrinsics.model, intrinsics.coeffs = rs.distortion.brown_conrady, [0.0] * 5
    return intrinsics


def _stream(kind: Any, index: int, camera: yfslam.Camera, bytes_per_pixel: int, pixels: Any) -> Any:
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid = kind, 0, index
    stream.width, stream.height, stream.fps, stream.bpp, stream.fmt = camera.width, camera.height, FPS, bytes_per_pixel, pixels
    stream.intrinsics = _intrinsics(camera)
    return stream


def _frame(profile: Any, data: Any, number: int, stamp_ms: float, bytes_per_pixel: int, scale: float = 0.0) -> Any:
    frame = rs.software_video_frame()
    frame.pixels = np.ascontiguousarray(data)
    frame.stride, frame.bpp = data.shape[1] * bytes_per_pixel, bytes_per_pixel
    frame.timestamp, frame.frame_number, frame.domain = stamp_ms, number, rs.timestamp_domain.hardware_clock
    frame.profile = profile.as_video_stream_profile()
    if scale:
        frame.depth_units = scale
    return frame


def record(path: pathlib.Path, world: yfslam.World, frames: list[yfslam.SynthFrame], repeated: set[int]) -> None:
    """Write a recording; the colour image of each frame in `repeated` is delivered once more, with the next depth image."""
    camera = world.camera
    device = rs.software_device()
    sensor = device.add_sensor("Stereo and RGB")
    scale = frames[0].frame.depth_scale
    assert scale is not None
    sensor.add_read_only_option(rs.option.depth_units, scale)
    color = sensor.add_video_stream(_stream(rs.stream.color, 1, camera, 3, rs.format.rgb8))
    depth = sensor.add_video_stream(_stream(rs.stream.depth, 2, camera, 2, rs.format.z16))
    extrinsics = rs.extrinsics()
    extrinsics.rotation, extrinsics.translation = [1.0, 0, 0, 0, 1, 0, 0, 0, 1], [0.0, 0, 0]
    depth.register_extrinsics_to(color, extrinsics)
    color.register_extrinsics_to(depth, extrinsics)
    recorder = rs.recorder(str(path), device)
    recorded = recorder.query_sensors()[0]
    queue = rs.frame_queue(2 * len(frames) + 10)
    recorded.open([color, depth])
    recorded.start(queue)
    for index, frame in enumerate(frames):
        shown = index - 1 if index in repeated else index
        stamp_ms = 1000.0 + frame.timestamp_ns * 1e-6
        color_ms = 1000.0 + frames[shown].timestamp_ns * 1e-6
        sensor.on_video_frame(_frame(color, frames[shown].rgb, shown + 1, color_ms, 3))
        sensor.on_video_frame(_frame(depth, frame.frame.depth, index + 1, stamp_ms, 2, scale))
        time.sleep(0.01)
    time.sleep(0.5)
    recorded.stop()
    recorded.close()
    del recorder
