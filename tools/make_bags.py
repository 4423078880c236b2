#!/usr/bin/env python3
"""Writes the frames of a folder in TUM layout into bags of every kind, with PyPI `rosbags`, and the same frames into a folder.

    python3 tools/make_bags.py FOLDER OUT [--frames N] [--repeat N]      makes a virtual environment in OUT/venv for itself

The folder OUT/folder has the colour images as PNG, decoded once, so that all bags but `jpeg` hold exactly its pixels.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

PACKAGES = ["rosbags==0.11.9", "numpy", "opencv-python-headless"]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--repeat", type=int, default=1, help="how often the frames come, one after the other, in bags named NAME_xN")
    parser.add_argument("--only", help="names of bags, separated by commas")
    return parser.parse_args()


def in_environment(out):
    """Starts this script again with the Python of its own environment."""
    python = out / "venv/bin/python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", out / "venv"], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    if Path(sys.prefix).resolve() != (out / "venv").resolve():
        os.execv(python, [python, *sys.argv])


args = arguments()
args.out.mkdir(parents=True, exist_ok=True)
in_environment(args.out)

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from rosbags.rosbag1 import Writer as Writer1  # noqa: E402
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin  # noqa: E402
from rosbags.rosbag2 import Writer as Writer2  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

COLOR, DEPTH, INFO = "/camera/color/image_raw", "/camera/aligned_depth_to_color/image_raw", "/camera/color/camera_info"


def nanoseconds(text):
    seconds, _, fraction = text.partition(".")
    return int(seconds) * 10**9 + int(fraction.ljust(9, "0")[:9])


def stamped(path):
    lines = [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return [(line[0], line[1:]) for line in lines]


def camera(path):
    keys = dict(line.split(":", 1) for line in path.read_text().splitlines() if ":" in line and not line.startswith(("%", "#")))
    number = lambda key: float(keys.get("Camera." + key, "0"))
    return {key: number(key) for key in ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "width", "height"]}


class Ros:
    """Messages of one version of ROS."""

    def __init__(self, version):
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
        self.serialize = self.store.serialize_ros1 if version == 1 else self.store.serialize_cdr

    def make(self, name, **fields):
        return self.store.types[name](**fields)

    def header(self, stamp_ns, frame="camera_color_optical_frame"):
        time = self.make("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        extra = {"seq": 0} if self.version == 1 else {}
        return self.make("std_msgs/msg/Header", stamp=time, frame_id=frame, **extra)

    def image(self, stamp_ns, encoding, pixels):
        return self.make("sensor_msgs/msg/Image", header=self.header(stamp_ns), height=pixels.shape[0], width=pixels.shape[1],
                         encoding=encoding, is_bigendian=0, step=pixels.strides[0], data=pixels.reshape(-1).view(np.uint8))

    def compressed(self, stamp_ns, format_, data):
        return self.make("sensor_msgs/msg/CompressedImage", header=self.header(stamp_ns), format=format_,
                         data=np.frombuffer(data, np.uint8))

    def info(self, stamp_ns, c):
        k = np.array([c["fx"], 0, c["cx"], 0, c["fy"], c["cy"], 0, 0, 1.0])
        p = np.array([c["fx"], 0, c["cx"], 0, 0, c["fy"], c["cy"], 0, 0, 0, 1.0, 0])
        d = np.array([c[key] for key in ["k1", "k2", "p1", "p2", "k3"]])
        r = np.eye(3).reshape(-1)
        roi = self.make("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        arrays = dict(D=d, K=k, R=r, P=p) if self.version == 1 else dict(d=d, k=k, r=r, p=p)
        return self.make("sensor_msgs/msg/CameraInfo", header=self.header(stamp_ns), height=int(c["height"]), width=int(c["width"]),
                         distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=roi, **arrays)

    def pose(self, stamp_ns, values):
        x, y, z, qx, qy, qz, qw = values
        point = self.make("geometry_msgs/msg/Point", x=x, y=y, z=z)
        rotation = self.make("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw)
        pose = self.make("geometry_msgs/msg/Pose", position=point, orientation=rotation)
        return self.make("geometry_msgs/msg/PoseStamped", header=self.header(stamp_ns, "world"), pose=pose)


def png(pixels):
    return cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()


def messages(ros, frames, truth, c, kind):
    """Yields topic, type, time of reception and message."""
    for index, (stamp, depth_stamp, color, depth, jpeg) in enumerate(frames):
        # Recorders receive images late; the stamps in the messages count.
        received = stamp + 45_000_000
        yield INFO, "sensor_msgs/msg/CameraInfo", received, ros.info(stamp, c)
        if kind in ("png", "jpeg"):
            data, format_ = (png(color), "rgb8; png compressed bgr8") if kind == "png" else (jpeg, "rgb8; jpeg compressed bgr8")
            yield COLOR + "/compressed", "sensor_msgs/msg/CompressedImage", received, ros.compressed(stamp, format_, data)
            data = bytes(12) + png(depth)
            yield (DEPTH + "/compressedDepth", "sensor_msgs/msg/CompressedImage", received + 1,
                   ros.compressed(depth_stamp, "16UC1; compressedDepth png", data))
        else:
            conversion = {"rgb8": cv2.COLOR_BGR2RGB, "rgba8": cv2.COLOR_BGR2RGBA, "bgra8": cv2.COLOR_BGR2BGRA}.get(kind)
            pixels = color if conversion is None else cv2.cvtColor(color, conversion)
            yield COLOR, "sensor_msgs/msg/Image", received, ros.image(stamp, kind, np.ascontiguousarray(pixels))
            yield DEPTH, "sensor_msgs/msg/Image", received + 1, ros.image(depth_stamp, "16UC1", depth)
    last = frames.last_stamp()
    for stamp, values in truth:
        if nanoseconds(stamp) <= last + 10**8:
            yield "/mocap/pose", "geometry_msgs/msg/PoseStamped", nanoseconds(stamp), ros.pose(nanoseconds(stamp), [float(v) for v in values])


class Repeated:
    """Frames that come several times, each time later; only one copy is in memory."""

    def __init__(self, frames, times):
        self.frames, self.times = frames, times
        self.period = frames[-1][0] - frames[0][0] + 33_333_333

    def __iter__(self):
        for repetition in range(self.times):
            for stamp, depth_stamp, *images in self.frames:
                yield stamp + repetition * self.period, depth_stamp + repetition * self.period, *images

    def last_stamp(self):
        return self.frames[-1][0] + (self.times - 1) * self.period


# Name: version of ROS, kind of images, compression.
BAGS = {
    "ros1_none.bag": (1, "rgb8", None),
    "ros1_lz4.bag": (1, "rgb8", "LZ4"),
    "ros1_bz2.bag": (1, "bgr8", "BZ2"),
    "ros1_png.bag": (1, "png", None),
    "ros1_jpeg.bag": (1, "jpeg", None),
    "mcap_none": (2, "rgb8", None),
    "mcap_zstd": (2, "bgr8", "STORAGE"),
    "mcap_message_zstd": (2, "rgba8", "MESSAGE"),
    "mcap_bgra": (2, "bgra8", None),
    "mcap_jpeg": (2, "jpeg", None),
    "db3_none": (2, "rgb8", None),
    "db3_message_zstd": (2, "rgb8", "MESSAGE"),
}


def write(path, version, kind, compression, frames, truth, c):
    ros = Ros(version)
    if version == 1:
        writer = Writer1(path)
        if compression:
            writer.set_compression(Writer1.CompressionFormat[compression])
    else:
        plugin = StoragePlugin.MCAP if path.name.startswith("mcap") else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
        if compression:
            writer.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for topic, type_, received, message in messages(ros, frames, truth, c, kind):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, type_, typestore=ros.store)
            writer.write(connections[topic], received, ros.serialize(message, type_))


def main():
    c = camera(args.folder / "camera.yaml")
    pairs = stamped(args.folder / "associations.txt")[: args.frames]
    truth = stamped(args.folder / "groundtruth.txt")
    frames = []
    folder = args.out / "folder"
    for name in ["rgb", "depth"]:
        (folder / name).mkdir(parents=True, exist_ok=True)
    lists = {"rgb": "", "depth": ""}
    for stamp, (color_name, depth_stamp, depth_name) in pairs:
        jpeg = (args.folder / color_name).read_bytes()
        color = cv2.imread(str(args.folder / color_name), cv2.IMREAD_COLOR)
        depth = cv2.imread(str(args.folder / depth_name), cv2.IMREAD_UNCHANGED)
        frames.append((nanoseconds(stamp), nanoseconds(depth_stamp), color, depth, jpeg))
        for kind, time, pixels in [("rgb", stamp, color), ("depth", depth_stamp, depth)]:
            lists[kind] += f"{time} {kind}/{time}.png\n"
            (folder / kind / f"{time}.png").write_bytes(png(pixels))
    for kind, text in lists.items():
        (folder / f"{kind}.txt").write_text(text)
    for name in ["camera.yaml", "groundtruth.txt"]:
        (folder / name).write_bytes((args.folder / name).read_bytes())
    for name, (version, kind, compression) in BAGS.items():
        # The kind stays in the beginning of the name, and the ending at its end.
        stem, dot, ending = name.partition(".")
        path = args.out / (f"{stem}_x{args.repeat}{dot}{ending}" if args.repeat > 1 else name)
        if path.exists() or (args.only and name not in args.only.split(",")):
            continue
        write(path, version, kind, compression, Repeated(frames, args.repeat), truth, c)
        print(path)


main()
