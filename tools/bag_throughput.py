#!/usr/bin/env python3
"""Compares how fast bags are decoded by this project and by PyPI `rosbags` with OpenCV, and whether memory grows with the length of a bag.

    python3 tools/make_bags.py FOLDER OUT --frames 60
    python3 tools/make_bags.py FOLDER OUT --frames 60 --repeat 10 --only mcap_jpeg
    cargo build --release -p yfslam-io --example decode_bag --features zstd-c
    OUT/venv/bin/python tools/bag_throughput.py target/release/examples/decode_bag OUT/ros1_png.bag OUT/mcap_jpeg …
    OUT/venv/bin/python tools/bag_throughput.py target/release/examples/decode_bag --memory OUT/mcap_jpeg OUT/mcap_jpeg_x10

Both read every colour and depth image of the bag into pixels, colours in the order that their users want (RGB, BGR). They run in turn,
five times each, so that both see the same load of the machine; the ratio is the median of the ratios of neighbouring runs. The start of the
interpreter is not counted. `--pinned` gives both one processor only.

`--memory SHORT LONG` compares the peak memory of this project on a bag and on one in which the same frames come many times, the median of
five runs each: unpacked chunks wait in a cache, and how many do depends on the threads. Exit code 1: the longer one takes more than a
quarter and 8 MiB more.
"""

import argparse
import os
import re
import resource
import statistics
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
RUNS = 5


def pixels(message):
    if hasattr(message, "format"):
        data = message.data[12:] if "compressedDepth" in message.format else message.data
        return cv2.imdecode(np.asarray(data), cv2.IMREAD_UNCHANGED)
    if message.encoding == "16UC1":
        return message.data.view(np.uint16).reshape(message.height, message.width).copy()
    image = message.data.reshape(message.height, message.width, CHANNELS[message.encoding])
    conversion = CONVERSIONS.get(message.encoding)
    return image.copy() if conversion is None else cv2.cvtColor(image, conversion)


def theirs(path):
    """Returns frames per second, processor time per frame in ms, and the number of frames."""
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


def compare_speed(program, paths):
    print(f"{'':24}{'rosbags + OpenCV':>26}{'yfslam':>26}{'ratio':>16}")
    print(f"{'bag':24}" + f"{'frames/s':>12}{'ms of CPU':>14}" * 2 + f"{'frames/s':>10}{'CPU':>6}")
    for path in paths:
        pairs = [(theirs(path), ours(program, path)) for _ in range(RUNS)]
        assert pairs[0][0][2] == pairs[0][1][2], f"{path}: {pairs[0][0][2]} and {pairs[0][1][2]} frames"
        middle = lambda side, value: statistics.median(pair[side][value] for pair in pairs)
        faster = statistics.median(b[0] / a[0] for a, b in pairs)
        cheaper = statistics.median(a[1] / b[1] for a, b in pairs)
        columns = "".join(f"{middle(side, 0):12.0f}{middle(side, 1):14.2f}" for side in (0, 1))
        print(f"{path.name:24}{columns}{faster:10.1f}{cheaper:6.1f}", flush=True)


def peak_mb(program, path):
    """Returns the median of the peaks, MiB, and the number of frames."""
    peaks = [one_peak_mb(program, path) for _ in range(RUNS)]
    return statistics.median(peak for peak, _ in peaks), peaks[0][1]


def one_peak_mb(program, path):
    text = subprocess.run([program, path], check=True, capture_output=True, text=True).stdout
    peak = re.search(r"peak (\d+) kB", text)
    if not peak:
        sys.exit("the memory of a process can be read on Linux only")
    return int(peak.group(1)) / 1024, int(re.search(r"(\d+) frames", text).group(1))


def compare_memory(program, short, long):
    (least, few), (most, many) = peak_mb(program, short), peak_mb(program, long)
    print(f"{short.name}: {few} frames, peak {least:.1f} MiB; {long.name}: {many} frames, peak {most:.1f} MiB; {most - least:+.1f} MiB")
    if most > 1.25 * least + 8:
        sys.exit("memory grows with the length of the bag")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="the example decode_bag")
    parser.add_argument("bags", type=Path, nargs="*")
    parser.add_argument("--memory", type=Path, nargs=2, metavar=("SHORT", "LONG"))
    parser.add_argument("--pinned", action="store_true")
    arguments = parser.parse_args()
    if arguments.pinned:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if arguments.memory:
        compare_memory(arguments.program, *arguments.memory)
    if arguments.bags:
        compare_speed(arguments.program, arguments.bags)


main()
