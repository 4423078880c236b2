#!/usr/bin/env python3
"""Compares the errors of trajectories in bags between `yfslam eval` and `evo`; the bags are written by PyPI `rosbags`.

    cargo build --release
    python3 tools/eval_bags.py TRUTH ESTIMATE OUT             two files in the format of TUM; a virtual environment in OUT/venv

Each bag has the ground truth as PoseStamped, and the estimate as PoseWithCovarianceStamped, Odometry, TransformStamped and as a chain of
transforms: /tf from map to odom and from odom to base, /tf_static from base to mast and from mast to camera. `evo` reads the chain only
where ROS is installed; it is compared with the poses from which it was made. Fails if an error differs by more than 1e-6 m or degrees.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

PACKAGES = ["rosbags==0.11.9", "evo==1.38.1", "numpy"]
TOLERANCE = 1e-6
ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/yfslam"

truth_path, estimate_path, out = [Path(argument) for argument in sys.argv[1:4]]
out.mkdir(parents=True, exist_ok=True)
python = out / "venv/bin/python"
if not python.exists():
    subprocess.run([sys.executable, "-m", "venv", out / "venv"], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
if Path(sys.prefix).resolve() != (out / "venv").resolve():
    os.execv(python, [python, *sys.argv])

import numpy as np  # noqa: E402
from evo.core import metrics, sync  # noqa: E402
from evo.tools import file_interface  # noqa: E402
from rosbags.rosbag1 import Reader as Reader1  # noqa: E402
from rosbags.rosbag1 import Writer as Writer1  # noqa: E402
from rosbags.rosbag2 import Reader as Reader2  # noqa: E402
from rosbags.rosbag2 import StoragePlugin  # noqa: E402
from rosbags.rosbag2 import Writer as Writer2  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

TRUTH, TOPICS, CHAIN = "/mocap", ["/amcl", "/odometry", "/vicon"], "/tf:map.camera"


def rows(path):
    """Returns nanoseconds and seven numbers of each line."""
    read = []
    for line in path.read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            stamp, *numbers = line.split()
            whole, _, fraction = stamp.partition(".")
            read.append((int(whole) * 10**9 + int(fraction.ljust(9, "0")[:9]), [float(number) for number in numbers]))
    return read


def product(a, b):
    """Composes two poses of seven numbers: translation, quaternion x y z w."""
    return [*(rotated(a[3:], b[:3]) + np.array(a[:3])), *multiplied(a[3:], b[3:])]


def inverse(a):
    turned = [-a[3], -a[4], -a[5], a[6]]
    return [*(-rotated(turned, a[:3])), *turned]


def multiplied(a, b):
    (x, y, z, w), (i, j, k, l) = a, b
    return [w * i + x * l + y * k - z * j, w * j - x * k + y * l + z * i, w * k + x * j - y * i + z * l, w * l - x * i - y * j - z * k]


def rotated(q, point):
    q = np.array(q) / np.linalg.norm(q)
    return np.array(multiplied(multiplied(q, [*point, 0.0]), [-q[0], -q[1], -q[2], q[3]])[:3])


class Ros:
    def __init__(self, version):
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
        if "tf2_msgs/msg/TFMessage" not in self.store.types:
            transforms = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
        self.serialize = self.store.serialize_ros1 if version == 1 else self.store.serialize_cdr

    def make(self, name, **fields):
        package, kind = name.split("/")
        return self.store.types[f"{package}/msg/{kind}"](**fields)

    def header(self, stamp_ns):
        time = self.make("builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        return self.make("std_msgs/Header", stamp=time, frame_id="map", **({"seq": 0} if self.version == 1 else {}))

    def pose(self, numbers):
        x, y, z, *q = numbers
        return self.make("geometry_msgs/Pose", position=self.make("geometry_msgs/Point", x=x, y=y, z=z), orientation=self.rotation(q))

    def rotation(self, q):
        return self.make("geometry_msgs/Quaternion", x=q[0], y=q[1], z=q[2], w=q[3])

    def covariant(self, numbers):
        return self.make("geometry_msgs/PoseWithCovariance", pose=self.pose(numbers), covariance=np.zeros(36))

    def transform(self, stamp_ns, parent, child, numbers):
        x, y, z, *q = numbers
        vector = self.make("geometry_msgs/Vector3", x=x, y=y, z=z)
        header = self.header(stamp_ns)
        header.frame_id = parent
        transform = self.make("geometry_msgs/Transform", translation=vector, rotation=self.rotation(q))
        return self.make("geometry_msgs/TransformStamped", header=header, child_frame_id=child, transform=transform)

    def messages(self, truth, estimate):
        """Yields topic, type, time and message."""
        for stamp, numbers in truth:
            yield TRUTH, "geometry_msgs/PoseStamped", stamp, self.make("geometry_msgs/PoseStamped", header=self.header(stamp), pose=self.pose(numbers))
        zero = self.make("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.0)
        twist = self.make("geometry_msgs/TwistWithCovariance", twist=self.make("geometry_msgs/Twist", linear=zero, angular=zero), covariance=np.zeros(36))
        mast, camera = [0.1, 0.0, 0.5, 0.0, 0.0, 0.6, 0.8], [0.0, 0.2, -0.1, 0.48, 0.6, 0.0, 0.64]
        drift = [0.3, -0.2, 0.0, 0.0, 0.28, 0.0, 0.96]
        static = [self.transform(0, "base", "mast", mast), self.transform(0, "mast", "camera", camera)]
        yield "/tf_static", "tf2_msgs/TFMessage", estimate[0][0], self.make("tf2_msgs/TFMessage", transforms=static)
        for stamp, numbers in estimate:
            header = self.header(stamp)
            base = product(product(inverse(drift), numbers), inverse(product(mast, camera)))
            moving = [self.transform(stamp, "map", "odom", drift), self.transform(stamp, "odom", "base", base)]
            for topic, kind, message in [
                ("/amcl", "geometry_msgs/PoseWithCovarianceStamped", dict(header=header, pose=self.covariant(numbers))),
                ("/odometry", "nav_msgs/Odometry", dict(header=header, child_frame_id="camera", pose=self.covariant(numbers), twist=twist)),
                ("/tf", "tf2_msgs/TFMessage", dict(transforms=moving)),
            ]:
                yield topic, kind, stamp, self.make(kind, **message)
            yield "/vicon", "geometry_msgs/TransformStamped", stamp, self.transform(stamp, "map", "camera", numbers)


def write(path, version, plugin, truth, estimate):
    ros = Ros(version)
    writer = Writer1(path) if version == 1 else Writer2(path, version=9, storage_plugin=plugin)
    connections = {}
    with writer:
        for topic, kind, stamp, message in ros.messages(truth, estimate):
            name = kind.replace("/", "/msg/")
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=ros.store)
            writer.write(connections[topic], stamp, ros.serialize(message, name))


def evo_errors(truth, estimate):
    truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=0.02)
    estimate.align(truth)
    errors = []
    for metric in [metrics.APE(metrics.PoseRelation.translation_part), metrics.RPE(metrics.PoseRelation.rotation_angle_deg, 1, metrics.Unit.frames)]:
        metric.process_data((truth, estimate))
        errors.append(metric.get_statistic(metrics.StatisticsType.rmse))
    return errors


def our_errors(*arguments):
    text = subprocess.run([PROGRAM, "eval", "--json", "--delta", "1f", *arguments], check=True, capture_output=True, text=True).stdout
    estimate = json.loads(text)["estimate"]
    return [estimate["ate"]["translation_m"]["rmse"], estimate["rpe"][0]["rotation_deg"]["rmse"]]


def main():
    truth, estimate = rows(truth_path), rows(estimate_path)
    worst = 0.0
    for name, version, plugin, reader in [("ros1.bag", 1, None, Reader1), ("mcap", 2, StoragePlugin.MCAP, Reader2), ("db3", 2, StoragePlugin.SQLITE3, Reader2)]:
        path = out / name
        if not path.exists():
            write(path, version, plugin, truth, estimate)
        for topic in [*TOPICS, CHAIN]:
            with reader(path) as bag:
                true_poses = file_interface.read_bag_trajectory(bag, TRUTH)
                read = file_interface.read_bag_trajectory(bag, topic if topic != CHAIN else TOPICS[0])
            theirs = evo_errors(true_poses, read)
            ours = our_errors(path, path, "--truth-topic", TRUTH, "--topic", topic)
            apart = max(abs(a - b) for a, b in zip(ours, theirs))
            worst = max(worst, apart)
            print(f"{name:10}{topic:16} ATE {ours[0]:.9f} m, evo {theirs[0]:.9f}; RPE {ours[1]:.9f}°, evo {theirs[1]:.9f}; {apart:.1e} apart")
    if worst > TOLERANCE:
        sys.exit(f"the errors differ by up to {worst:.1e}")


main()
