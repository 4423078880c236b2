#!/usr/bin/env python3
"""Listens to /tf and /tf_static of yfslam-ros2 with a second implementation of DDS, Cyclone, and checks REP 105.

  tools/ros2/cyclone.py SECONDS      while the node runs in the same ROS_DOMAIN_ID; prints one JSON object
"""

import json
import os
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


def main():
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(100))
    moving = DataReader(participant, Topic(participant, "rt/tf", TFMessage, qos=qos), qos=qos)
    latched = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(100), Policy.Durability.TransientLocal)
    fixed = DataReader(participant, Topic(participant, "rt/tf_static", TFMessage, qos=latched), qos=latched)
    frames, until = {}, time.monotonic() + float(sys.argv[1])
    while time.monotonic() < until:
        for reader in (moving, fixed):
            for message in reader.take(N=100):
                for t in message.transforms:
                    ns = t.header.stamp.sec * 10**9 + t.header.stamp.nanosec
                    place = (t.transform.translation.x, t.transform.translation.y, t.transform.translation.z)
                    frames.setdefault(f"{t.header.frame_id} -> {t.child_frame_id}", []).append((ns, place))
        time.sleep(0.01)
    result = {}
    for name, poses in frames.items():
        steps = [sum((a - b) ** 2 for a, b in zip(p, q)) ** 0.5 for (_, p), (_, q) in zip(poses, poses[1:])]
        result[name] = {"transforms": len(poses), "largest step, m": round(max(steps, default=0.0), 4)}
    print(json.dumps(result, indent=1))
    return 0 if result else 1


if __name__ == "__main__":
    sys.exit(main())
