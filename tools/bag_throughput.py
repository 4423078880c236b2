#!/usr/bin/env python3
"""Decodes bags with PyPI `rosbags` and OpenCV, and with the example decode_bag, and prints frames per second of both.

    python3 tools/make_bags.py FOLDER OUT --frames 300
    cargo build --release -p yfslam-io --example decode_bag
    OUT/venv/bin/python tools/bag_throughput.py target/release/examples/decode_bag OUT/ros1_none.bag OUT/mcap_jpeg …

Both read every colour and depth image of the bag into pixels, colours in the order that their users want (RGB, BGR), in one process. The
best of five runs counts, without the start of the interpreter. On a busy machine the processor time says more than frames per second.
"""

import re
import resource
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

CONVERSIONS = {"rgb8": cv2.COLOR_RGB2BGR, "rgba8": cv2.COLOR_RGBA2BGR, "bgra8": cv2.COLOR_BGRA2BGR}
CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}


def pixels(message):
    if hasattr(message, "format"):
        data = message.data[12:] if "compressedDepth" in message.format else message.data
        return cv2.imdecode(np.asarray(data), cv2.IMREAD_UNCHANGED)
    if message.encoding == "16UC1":
        return message.data.view(np.uint16).reshape(message.height, message.width).copy()
    image = message.data.reshape(message.height, message.width, CHANNELS[message.encoding])
    conversion = CONVERSIONS.get(message.encoding)
    return image.copy() if conversion is None else cv2.cvtColor(image, conversion)


def python(path):
    """Returns frames per second, and processor time per frame, ms."""
    started, images, before = time.perf_counter(), 0, time.process_time()
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        connections = [c for c in reader.connections if c.msgtype.endswith("Image")]
        for connection, _, raw in reader.messages(connections):
            images += pixels(reader.deserialize(raw, connection.msgtype)) is not None
    frames = images / 2
    return frames / (time.perf_counter() - started), (time.process_time() - before) / frames * 1e3, frames


def ours(program, path):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    text = subprocess.run([program, path], check=True, capture_output=True, text=True).stdout
    frames, seconds = re.search(r"(\d+) frames ([\d.]+) s", text).groups()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return int(frames) / float(seconds), busy / int(frames) * 1e3, int(frames)


def main():
    program, paths = sys.argv[1], [Path(p) for p in sys.argv[2:]]
    print(f"{'':22}{'rosbags + OpenCV':>26}{'yfslam':>26}{'ratio':>16}")
    print(f"{'bag':22}" + f"{'frames/s':>12}{'ms of CPU':>14}" * 2 + f"{'frames/s':>10}{'CPU':>6}")
    for path in paths:
        theirs, mine = [python(path) for _ in range(5)], [ours(program, path) for _ in range(5)]
        assert theirs[0][2] == mine[0][2], f"{path}: {theirs[0][2]} and {mine[0][2]} frames"
        rates, times = [[best(run[k] for run in runs) for runs in (theirs, mine)] for k, best in enumerate((max, min))]
        columns = "".join(f"{rate:12.0f}{time_:14.2f}" for rate, time_ in zip(rates, times))
        print(f"{path.name:22}{columns}{rates[1] / rates[0]:10.1f}{times[0] / times[1]:6.1f}")


main()
