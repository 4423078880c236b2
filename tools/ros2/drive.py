#!/usr/bin/env python3
"""Plays a recording over a real ROS 2 to yfslam-ros2, and receives what it publishes.

  tools/ros2/drive.py --node target/release/yfslam-ros2 --recording DIR --out DIR

One process publishes, one receives, so that neither waits for the other. Prints one JSON object, and writes pose.txt (poses in the map) and
odom.txt (poses in odom) with the stamps of the recording, for `yfslam eval`.
"""

import argparse
import json
import multiprocessing
import os
import pathlib
import signal
import subprocess
import sys
import time

import recording


COMPRESSED = ("/compressed", "/compressedDepth")


def publish(folder, limit, rate, reliable, packed, times, ready, go):
    import rclpy
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    rclpy.init(args=[])
    node = rclpy.create_node("camera")
    kind = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
    qos = QoSProfile(depth=5, reliability=kind)
    of, suffixes = (recording.CompressedImage, COMPRESSED) if packed else (recording.Image, ("", ""))
    color = node.create_publisher(of, recording.COLOR + suffixes[0], qos)
    depth = node.create_publisher(of, recording.DEPTH + suffixes[1], qos)
    info = node.create_publisher(recording.CameraInfo, recording.INFO, qos)
    frames = (recording.load_files if packed else recording.load)(folder, limit)
    calibration = recording.camera_info(folder)
    ready.set()
    go.wait()
    # The calibration comes with every image; before the first one the node waits for it.
    for _ in range(30):
        info.publish(calibration)
        time.sleep(0.1)
        if info.get_subscription_count() and color.get_subscription_count() and depth.get_subscription_count():
            break
    info.publish(calibration)
    time.sleep(1.0)
    began, first = time.monotonic(), frames[0][0]
    for stamp, rgb, raw in frames:
        due = began + (stamp - first) / 1e9 / rate
        time.sleep(max(0.0, due - time.monotonic()))
        calibration.header.stamp = rgb.header.stamp
        times[stamp] = time.monotonic()
        color.publish(rgb)
        depth.publish(raw)
        info.publish(calibration)
    time.sleep(2.0)
    node.destroy_node()
    rclpy.shutdown()


def percentile(values, share):
    ordered = sorted(values)
    return ordered[max(0, min(len(ordered) - 1, int(round(share * len(ordered) + 0.5)) - 1))] if ordered else None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--node", required=True)
    parser.add_argument("--recording", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--rate", type=float, default=1.0)
    parser.add_argument("--domain", default="42")
    parser.add_argument("--reliable", action="store_true")
    parser.add_argument("--compressed", action="store_true", help="send JPEG and compressedDepth")
    parser.add_argument("-p", action="append", default=[], help="parameter of the node, NAME:=VALUE")
    options = parser.parse_args()
    os.environ["ROS_DOMAIN_ID"] = options.domain
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)

    manager = multiprocessing.Manager()
    times, ready, go = manager.dict(), manager.Event(), manager.Event()
    camera = multiprocessing.get_context("spawn").Process(
        target=publish, args=(options.recording, options.frames, options.rate, options.reliable, options.compressed, times, ready, go)
    )
    camera.start()

    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import OccupancyGrid, Odometry, Path
    from rclpy.parameter import Parameter
    from rclpy.parameter_client import AsyncParameterClient
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import PointCloud2
    from std_srvs.srv import Trigger
    from visualization_msgs.msg import MarkerArray

    parameters = ["depth_units_per_metre:=5000", f"base_frame:={recording.FRAME}", f"map_file:={out / 'ros.map'}",
                  f"trajectory_file:={out / 'final.txt'}"] + options.p
    if options.compressed:
        parameters += [f"color_topic:={recording.COLOR}{COMPRESSED[0]}", f"depth_topic:={recording.DEPTH}{COMPRESSED[1]}"]
    command = [options.node, "--ros-args"] + [word for p in parameters for word in ("-p", p)]
    ready.wait()
    log = open(out / "node.log", "w")
    node_process = subprocess.Popen(command, stderr=log)

    rclpy.init(args=[])
    node = rclpy.create_node("listener")
    received = {name: [] for name in ("odom", "pose", "path", "grid", "cloud", "graph", "people", "diagnostics")}

    def keep(name):
        return lambda message: received[name].append((time.monotonic(), message))

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(Odometry, "/odom", keep("odom"), 100)
    node.create_subscription(PoseWithCovarianceStamped, "/yfslam/pose", keep("pose"), 100)
    node.create_subscription(Path, "/yfslam/path", keep("path"), 10)
    node.create_subscription(OccupancyGrid, "/map", keep("grid"), latched)
    node.create_subscription(PointCloud2, "/yfslam/landmarks", keep("cloud"), 10)
    node.create_subscription(MarkerArray, "/yfslam/graph", keep("graph"), 10)
    node.create_subscription(MarkerArray, "/yfslam/people", keep("people"), 10)
    node.create_subscription(DiagnosticArray, "/diagnostics", keep("diagnostics"), 10)
    save = node.create_client(Trigger, "/yfslam/save_map")
    began = time.monotonic()
    while time.monotonic() - began < 3.0:
        rclpy.spin_once(node, timeout_sec=0.1)
    go.set()
    while camera.is_alive():
        rclpy.spin_once(node, timeout_sec=0.05)

    def call(future, seconds=20.0):
        rclpy.spin_until_future_complete(node, future, timeout_sec=seconds)
        return future.result()

    has_service = save.wait_for_service(timeout_sec=5.0)
    answer = call(save.call_async(Trigger.Request())) if has_service else None
    client = AsyncParameterClient(node, "/yfslam")
    set_answer = refused = None
    if client.wait_for_services(timeout_sec=5.0):
        done = call(client.set_parameters([Parameter("grid_period", value=2.0), Parameter("method", value="none")]))
        if done:
            set_answer, refused = done.results[0].successful, done.results[1].reason
    late = []
    node.create_subscription(OccupancyGrid, "/map", late.append, latched)
    until = time.monotonic() + 3.0
    while not late and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.1)
    publishers = node.get_publishers_info_by_topic("/odom")
    # Processor time of the node, and of its thread for DDS.
    ticks = os.sysconf("SC_CLK_TCK")
    threads = {}
    for task in pathlib.Path(f"/proc/{node_process.pid}/task").iterdir():
        fields = (task / "stat").read_text().rsplit(")", 1)[1].split()
        name = (task / "comm").read_text().strip()
        threads[name] = threads.get(name, 0) + (int(fields[11]) + int(fields[12])) / ticks
    node_process.send_signal(signal.SIGTERM)
    code = node_process.wait(timeout=60)

    sent = dict(times)
    stamp = lambda message: message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    latency = [1e3 * (at - sent[stamp(m)]) for at, m in received["odom"] if stamp(m) in sent]
    for name in ("pose", "odom"):
        with open(out / f"{name}.txt", "w") as file:
            for _, m in received[name]:
                p, q = m.pose.pose.position, m.pose.pose.orientation
                file.write(f"{stamp(m) / 1e9:.9f} {p.x} {p.y} {p.z} {q.x} {q.y} {q.z} {q.w}\n")
    steps = []
    for (_, a), (_, b) in zip(received["odom"], received["odom"][1:]):
        a, b = a.pose.pose.position, b.pose.pose.position
        steps.append(((a.x - b.x) ** 2 + (a.y - b.y) ** 2 + (a.z - b.z) ** 2) ** 0.5)
    last = received["diagnostics"][-1][1].status[0] if received["diagnostics"] else None
    grids = [m for _, m in received["grid"]]
    result = {
        "sent pairs": len(sent),
        "received": {name: len(messages) for name, messages in received.items()},
        "latency image to odometry, ms": {"p50": percentile(latency, 0.5), "p99": percentile(latency, 0.99), "max": max(latency, default=None)},
        "largest step of odom, m": max(steps, default=None),
        "last path": len(received["path"][-1][1].poses) if received["path"] else 0,
        "last cloud": received["cloud"][-1][1].width if received["cloud"] else 0,
        "last graph": [[m.ns, len(m.points)] for m in received["graph"][-1][1].markers] if received["graph"] else None,
        "boxes of people": sum(len(m.markers) - 1 for _, m in received["people"]),
        "last grid": [grids[-1].info.width, grids[-1].info.height, sum(v == 100 for v in grids[-1].data), sum(v == 0 for v in grids[-1].data)] if grids else None,
        "grid for a late listener": bool(late),
        "save_map": [answer.success, answer.message] if answer else "no answer",
        "set grid_period": set_answer,
        "set method": refused,
        "node that publishes odom": [p.node_name for p in publishers],
        "diagnostics": {v.key: v.value for v in last.values} | {"message": last.message} if last else None,
        "processor time of threads, s": {name: round(seconds, 2) for name, seconds in sorted(threads.items(), key=lambda t: -t[1])},
        "exit code": code,
    }
    print(json.dumps(result, indent=1))
    node.destroy_node()
    rclpy.shutdown()
    return 0 if received["odom"] and code == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
