#!/usr/bin/env python3
"""Decodes bags with PyPI `rosbags` and OpenCV, and with the example decode_bag, and prints frames per second of both.

    python3 tools/make_bags.py FOLDER OUT --frames 300
    cargo build --release -p yfslam-io --example decode_bag
    OUT/venv/bin/python tools/bag_throughput.py target/release/examples/decode_bag OUT/ros1_none.bag OUT/mcap_jpeg …

Both read every colour and depth image of the bag into pixels, colours in the order that their users want (RGB, BGR), in one process. The
best of five runs counts, without the start of the interpreter.
"""

import re
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
    started, images = time.perf_counter(), 0
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        connections = [c for c in reader.connections if c.msgtype.endswith("Image")]
        for connection, _, raw in reader.messages(connections):
            images += pixels(reader.deserialize(raw, connection.msgtype)) is not None
    return images / 2 / (time.perf_counter() - started)


def ours(program, path):
    text = subprocess.run([program, path], check=True, capture_output=True, text=True).stdout
    frames, seconds = re.search(r"(\d+) frames ([\d.]+) s", text).groups()
    return int(frames) / float(seconds)


def main():
    program, paths = sys.argv[1], [Path(p) for p in sys.argv[2:]]
    print(f"{'bag':24}{'rosbags + OpenCV':>20}{'yfslam':>14}{'ratio':>8}   (frames/s, {cv2.getNumThreads()} threads of OpenCV)")
    for path in paths:
        theirs = max(python(path) for _ in range(5))
        mine = max(ours(program, path) for _ in range(5))
        print(f"{path.name:24}{theirs:20.0f}{mine:14.0f}{mine / theirs:8.1f}")


main()
