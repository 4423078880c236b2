"""A recording in TUM layout, as messages of ROS 2."""

import array
import pathlib

import numpy
from PIL import Image as Picture
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

FRAME = "camera_color_optical_frame"
COLOR = "/camera/camera/color/image_raw"
DEPTH = "/camera/camera/aligned_depth_to_color/image_raw"
INFO = "/camera/camera/color/camera_info"


def seconds_to_ns(text):
    whole, _, fraction = text.partition(".")
    return int(whole) * 10**9 + int(fraction.ljust(9, "0")[:9])


def pairs(folder, limit):
    """Returns (stamp, colour file, stamp of depth, depth file) of the first pairs."""
    lines = (pathlib.Path(folder) / "associations.txt").read_text().splitlines()
    rows = [line.split() for line in lines if line and not line.startswith("#")]
    return [(seconds_to_ns(row[0]), row[1], seconds_to_ns(row[2]), row[3]) for row in rows[:limit]]


def image(header, encoding, pixels):
    message = Image(encoding=encoding, is_bigendian=0)
    message.header = header
    message.height, message.width = pixels.shape[:2]
    message.step = pixels.strides[0]
    message.data = array.array("B", pixels.tobytes())
    return message


def load_files(folder, limit):
    """Returns (stamp, colour file, depth file) as messages of `compressed` and `compressedDepth` transports."""
    from std_msgs.msg import Header

    loaded = []
    for stamp, color, depth_stamp, depth in pairs(folder, limit):
        files = [(pathlib.Path(folder) / name).read_bytes() for name in (color, depth)]
        # The head of compressedDepth, which only depth in metres needs.
        messages = [CompressedImage(header=Header(frame_id=FRAME), format=form, data=array.array("B", data)) for form, data in
                    (("rgb8; jpeg compressed bgr8", files[0]), ("16UC1; compressedDepth png", bytes(12) + files[1]))]
        for message, ns in zip(messages, (stamp, depth_stamp)):
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, 10**9)
        loaded.append((stamp, *messages))
    return loaded


def load(folder, limit):
    """Returns (stamp, colour message, depth message) of the first pairs."""
    from std_msgs.msg import Header

    loaded = []
    for stamp, color, depth_stamp, depth in pairs(folder, limit):
        rgb = numpy.asarray(Picture.open(pathlib.Path(folder) / color).convert("RGB"))
        raw = numpy.asarray(Picture.open(pathlib.Path(folder) / depth)).astype(numpy.uint16)
        messages = image(Header(frame_id=FRAME), "rgb8", rgb), image(Header(frame_id=FRAME), "16UC1", raw)
        for message, ns in zip(messages, (stamp, depth_stamp)):
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, 10**9)
        loaded.append((stamp, *messages))
    return loaded


def camera_info(folder):
    """Reads the keys of an ORB-SLAM camera file."""
    values = {}
    for line in (pathlib.Path(folder) / "camera.yaml").read_text().splitlines():
        key, _, value = line.partition(":")
        values[key.strip().rsplit(".", 1)[-1]] = value.split("#")[0].strip()
    fx, fy, cx, cy = (float(values[key]) for key in ("fx", "fy", "cx", "cy"))
    info = CameraInfo(width=640, height=480, distortion_model="plumb_bob")
    info.header.frame_id = FRAME
    info.d = [float(values.get(key, 0)) for key in ("k1", "k2", "p1", "p2", "k3")]
    info.k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    info.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    info.p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return info
