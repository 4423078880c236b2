"""Reads recordings of `yfslam run --record` with the Python packages `mcap` and `mcap-ros2-support`, which nobody here wrote.

    check_mcap.py PROGRAM
"""

import collections
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory


def main(program: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder)
        recording = out / "run.mcap"
        subprocess.run([program, "run", "synth:walking_xyz?people=2&frames=45", "--record", recording, "-o", out / "run", "--quiet"], check=True)
        report = json.loads((out / "run/run.json").read_text())
        live = [line.split() for line in (out / "run/live.txt").read_text().splitlines() if not line.startswith("#")]
        counts, last, poses, stamps = collections.Counter(), {}, [], []
        with recording.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            summary = reader.get_summary()
            assert summary.statistics.message_count == sum(summary.statistics.channel_message_counts.values())
            for schema, channel, message, decoded in reader.iter_decoded_messages():
                counts[channel.topic] += 1
                last[channel.topic] = decoded
                stamps.append(message.log_time)
                if channel.topic == "/yfslam/odometry":
                    p = decoded.pose.pose.position
                    poses.append((decoded.header.stamp.sec + decoded.header.stamp.nanosec / 1e9, p.x, p.y, p.z))
        assert stamps == sorted(stamps), "messages are read in the order of time"
        assert sum(counts.values()) == summary.statistics.message_count
        frames, tracked = report["frames"]["read"], report["frames"]["tracked"]
        assert counts["/yfslam/overlay/compressed"] == counts["/yfslam/overlay/camera_info"] == counts["/yfslam/state"] == frames
        assert counts["/tf"] == counts["/yfslam/odometry"] == tracked == len(live), counts
        # The odometry is live.txt in axes with z up: x forward, y to the left.
        for (t, x, y, z), line in zip(poses, live):
            lt, lx, ly, lz = map(float, line[:4])
            assert abs(t - lt) < 1e-5 and math.dist((x, y, z), (lz, -lx, -ly)) < 1e-5, (t, x, y, z, line)
        image = last["/yfslam/overlay/compressed"]
        assert image.format == "jpeg" and bytes(image.data[:2]) == b"\xff\xd8", image.format
        camera = last["/yfslam/overlay/camera_info"]
        assert abs(camera.k[0] - report["camera"]["fx"]) < 1e-9 and camera.width == report["camera"]["width"]
        cloud = last["/yfslam/landmarks"]
        assert cloud.width == report["map"]["landmarks"] and [field.name for field in cloud.fields] == ["x", "y", "z", "rgb"]
        assert len(cloud.data) == cloud.width * cloud.point_step == cloud.row_step
        assert all(math.isfinite(value) for value in struct.unpack_from("<3f", bytes(cloud.data)))
        assert len(last["/yfslam/path"].poses) == tracked
        fixed = last["/tf_static"].transforms[0]
        assert (fixed.header.frame_id, fixed.child_frame_id) == ("map", "world")
        assert last["/tf"].transforms[0].child_frame_id == "camera" and "inliers" in last["/yfslam/state"].data
        print("1 passed, 0 failed:", dict(counts))


if __name__ == "__main__":
    main(sys.argv[1])
