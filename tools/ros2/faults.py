#!/usr/bin/env python3
"""A fault drill over a real ROS 2: each fault ends in the behaviour that the manual states. Prints a table.

  tools/ros2/faults.py --node target/release/yfslam-ros2 --recording DIR [--only NAME]
"""

import argparse
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import recording


def camera(options):
    """Publishes a part of the recording; runs as a process of its own, so that it can be killed."""
    import rclpy
    from rclpy.qos import qos_profile_sensor_data

    rclpy.init(args=[])
    node = rclpy.create_node("camera")
    color = node.create_publisher(recording.Image, recording.COLOR, qos_profile_sensor_data)
    depth = node.create_publisher(recording.Image, recording.DEPTH, qos_profile_sensor_data)
    info = node.create_publisher(recording.CameraInfo, recording.INFO, qos_profile_sensor_data)
    frames = recording.load(options.recording, options.end)[options.start :]
    calibration = recording.camera_info(options.recording)
    until = time.monotonic() + 5.0
    while not color.get_subscription_count() and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(0.5)
    if not options.no_info:
        info.publish(calibration)
        time.sleep(0.5)
    print("begins", flush=True)
    began, first = time.monotonic(), frames[0][0]
    for stamp, rgb, raw in frames:
        time.sleep(max(0.0, began + (stamp - first) / 1e9 - time.monotonic()))
        for message in (rgb, raw):
            ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec + int(options.shift * 1e9)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, 10**9)
            if options.small:
                message.width, message.height = 320, 240
        color.publish(rgb)
        if not options.no_depth:
            depth.publish(raw)
        if not options.no_info:
            calibration.header.stamp = rgb.header.stamp
            info.publish(calibration)
    time.sleep(0.5)


class Drill:
    """A node, and a listener to what it publishes."""

    def __init__(self, options, folder, parameters=()):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from nav_msgs.msg import Odometry
        from rclpy.executors import SingleThreadedExecutor
        from std_srvs.srv import Trigger
        import threading

        self.options, self.folder = options, pathlib.Path(folder)
        self.map = self.folder / "drill.map"
        base = ["depth_units_per_metre:=5000", f"base_frame:={recording.FRAME}", f"map_file:={self.map}", "grid:=false"]
        words = [word for p in [*base, *parameters] for word in ("-p", p)]
        self.log = open(self.folder / "node.log", "w")
        self.process = subprocess.Popen([options.node, "--ros-args", *words], stderr=self.log)
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.ros = rclpy.create_node("listener", context=self.context)
        self.odometry, self.status = [], None
        self.ros.create_subscription(Odometry, "/odom", self.odometry.append, 100)
        self.ros.create_subscription(DiagnosticArray, "/diagnostics", self.keep, 10)
        self.save = self.ros.create_client(Trigger, "/yfslam/save_map")
        self.request = Trigger.Request
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self.ros)
        threading.Thread(target=executor.spin, daemon=True).start()
        time.sleep(1.0)

    def keep(self, message):
        self.status = message.status[0]

    def value(self, key):
        return next((pair.value for pair in self.status.values if pair.key == key), "-") if self.status else "-"

    def play(self, start, end, wait=True, **more):
        words = [sys.executable, __file__, "--camera", "--recording", self.options.recording, "--start", str(start), "--end", str(end)]
        for name, value in more.items():
            words += [f"--{name.replace('_', '-')}"] + ([] if value is True else [str(value)])
        child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        child.stdout.readline()
        if wait:
            child.wait()
        return child

    def count(self):
        return len(self.odometry)

    def end(self, which=signal.SIGTERM):
        self.process.send_signal(which)
        code = self.process.wait(timeout=60)
        self.context.shutdown()
        return code


def killed(drill):
    child = drill.play(0, 300, wait=False)
    time.sleep(3.0)
    child.kill()
    time.sleep(2.5)
    before, silent = drill.count(), drill.status.message
    drill.play(100, 200)
    time.sleep(1.2)
    return before > 20 and drill.count() > before + 50, f"{before} poses, then '{silent}', then {drill.count() - before} poses; {drill.status.message}"


def jump(drill):
    drill.play(0, 100)
    before = drill.count()
    drill.play(100, 200, shift=-3600)
    time.sleep(1.2)
    last = drill.odometry[-1].header.stamp.sec
    return drill.count() > before + 50 and drill.value("clock jumps") == "1", (
        f"{before} poses, then {drill.count() - before} with stamps an hour earlier (last {last}); clock jumps: {drill.value('clock jumps')}"
    )


def sizes(drill):
    drill.play(0, 60)
    before = drill.count()
    drill.play(60, 90, small=True)
    between = drill.count()
    time.sleep(1.2)
    reason = drill.value("last reason for that")
    drill.play(90, 150)
    return between == before and drill.count() > between + 30, f"{before} poses, {between - before} while wrong ({reason}), then {drill.count() - between}"


def depth(drill):
    drill.play(0, 60)
    before = drill.count()
    drill.play(60, 100, no_depth=True)
    time.sleep(1.2)
    between, message = drill.count(), drill.status.message
    drill.play(100, 160)
    return between == before and drill.count() > between + 30, f"{before} poses, {between - before} without depth ('{message}'), then {drill.count() - between}"


def late_info(drill):
    drill.play(0, 60, no_info=True)
    time.sleep(1.2)
    before, message = drill.count(), drill.status.message
    drill.play(60, 120)
    return before == 0 and drill.count() > 30, f"{before} poses ('{message}'), then {drill.count()}"


def slow(drill):
    from nav_msgs.msg import Odometry
    from rclpy.qos import QoSProfile
    import rclpy

    context = rclpy.Context()
    rclpy.init(context=context)
    # Never spun: what is sent to it is never taken.
    node = rclpy.create_node("slow", context=context)
    node.create_subscription(Odometry, "/odom", lambda _: None, QoSProfile(depth=1))
    drill.play(0, 150)
    time.sleep(1.2)
    result = drill.count() > 75, f"{drill.count()} poses for the other listener; median latency {drill.value('latency image to pose, median, ms')} ms"
    context.shutdown()
    return result


def saving(drill, which):
    drill.play(0, 100)
    drill.save.wait_for_service(timeout_sec=5.0)
    drill.save.call_async(drill.request())
    time.sleep(0.01)
    return drill.end(which)


def loads(drill):
    """Returns whether the file is a whole map, by loading it."""
    if not drill.map.exists():
        return "no file"
    words = ["-p", f"load_map:={drill.map}", "-p", "localise_only:=true", "-p", f"base_frame:={recording.FRAME}", "-p", "grid:=false"]
    (drill.folder / "again").mkdir()
    again = Drill(drill.options, drill.folder / "again", words[1::2])
    again.play(0, 60)
    time.sleep(1.2)
    found = again.count()
    code = again.end()
    return f"whole, {found} poses in it" if code == 0 and found else f"NOT usable (exit {code}, {found} poses)"


def sigterm(drill):
    code = saving(drill, signal.SIGTERM)
    file = loads(drill)
    return code == 0 and file.startswith("whole"), f"exit {code}; file: {file}"


def sigkill(drill):
    code = saving(drill, signal.SIGKILL)
    file = loads(drill)
    return file == "no file" or file.startswith("whole"), f"exit {code}; file: {file}"


FAULTS = {
    "publisher killed and restarted": (killed, ()),
    "stamps jump back by an hour": (jump, ()),
    "images of a wrong size": (sizes, ()),
    "depth missing": (depth, ()),
    "camera_info late": (late_info, ()),
    "a listener that never reads": (slow, ()),
    "SIGTERM while saving": (sigterm, ("save_on_exit:=true",)),
    "SIGKILL while saving": (sigkill, ()),
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--node")
    parser.add_argument("--recording", required=True)
    parser.add_argument("--only")
    parser.add_argument("--camera", action="store_true")
    parser.add_argument("--start", type=int, default=0)
    parser.add_argument("--end", type=int, default=100)
    parser.add_argument("--shift", type=float, default=0.0)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--no-depth", action="store_true")
    parser.add_argument("--no-info", action="store_true")
    options = parser.parse_args()
    os.environ.setdefault("ROS_DOMAIN_ID", "43")
    if options.camera:
        return camera(options)
    failed = 0
    for name, (fault, parameters) in FAULTS.items():
        if options.only and options.only not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            drill = Drill(options, folder, parameters)
            try:
                is_right, text = fault(drill)
            except Exception as error:  # the drill goes on with the next fault
                is_right, text = False, f"{type(error).__name__}: {error}"
            if drill.process.poll() is None:
                drill.end()
            failed += not is_right
            print(f"| {name} | {text} | {'yes' if is_right else 'NO'} |", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
