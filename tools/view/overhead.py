"""Measures what the live view costs: processor time of `yfslam run` without it, with it, and with a viewer at the speed of the recording.

    overhead.py PROGRAM RECORDING [ROUNDS] [OPTIONS OF RUN...]

The viewer asks for everything that is newer than what it has, as the page does. The three ways take turns. The cost is the additional processor
time of the process per second of the recording: 5 % are a twentieth of a core.
"""

import http.client
import json
import os
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import threading


def watch(address: str, seen: dict) -> None:
    """Asks for news until the run ends."""
    connection = http.client.HTTPConnection(address, timeout=30)
    connection.request("POST", "/control?do=speed&speed=1", headers={"Origin": f"http://{address}"})
    connection.getresponse().read()
    numbers = {"frame": 0, "map": 0, "patch": 0, "path": 0, "control": 0}
    try:
        while True:
            query = "&".join(f"{'paths' if key == 'path' else key}={value}" for key, value in numbers.items())
            connection.request("GET", f"/next?run=0&{query}")
            body = connection.getresponse().read()
            at = 0
            while at < len(body):
                length, head = struct.unpack_from("<II", body, at)
                packet = json.loads(body[at + 8 : at + 8 + head])
                numbers[packet["kind"]] = packet["number"]
                seen[packet["kind"]] = seen.get(packet["kind"], 0) + 1
                seen["bytes"] = seen.get("bytes", 0) + length + 4
                at += 4 + length
                if packet["kind"] == "control" and packet["ended"]:
                    return
    except (OSError, http.client.HTTPException):
        return


def run(program: str, arguments: list, way: str) -> tuple[float, dict]:
    """Returns the processor time of a run, s, and what the viewer saw."""
    with tempfile.TemporaryDirectory() as out:
        command = [program, "run", *arguments, "-o", out] + ([] if way == "plain" else ["--view=0"])
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        seen: dict = {}
        for line in child.stderr:
            match = re.search(r"live view: http://([\d.:]+)/", line)
            if match and way == "viewer":
                threading.Thread(target=watch, args=(match[1], seen), daemon=True).start()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        assert child.returncode == 0, f"{command} ended with {child.returncode}"
        report = json.load(open(os.path.join(out, "run.json")))
        seen["frames"] = report["frames"]["read"]
        seen["fps"] = report["camera"]["fps"]
        return usage.ru_utime + usage.ru_stime, seen


def main() -> None:
    program, recording, rounds, *options = [*sys.argv[1:3], *(sys.argv[3:] or ["3"])]
    ways = {"plain": "without the flag", "idle": "--view, no viewer", "viewer": "--view, a viewer"}
    times = {way: [] for way in ways}
    for _ in range(int(rounds)):
        for way in ways:
            seconds, seen = run(program, [recording, *options], way)
            times[way].append(seconds)
    duration = seen["frames"] / seen["fps"]
    plain = statistics.median(times["plain"])
    print(f"{seen['frames']} frames, {duration:.1f} s at {seen['fps']:.0f} Hz; {seen.get('frame', 0)} frames, {seen.get('map', 0)} maps and", end=" ")
    print(f"{seen['bytes'] / duration / 1e6:.2f} MB/s went to the viewer; median of {rounds} runs (least to most)")
    for way, name in ways.items():
        values = times[way]
        ratio = statistics.median(values) / plain
        core = (statistics.median(values) - plain) / duration
        print(f"{name:20} {statistics.median(values):6.2f} s ({min(values):.2f} to {max(values):.2f})  ratio {ratio:.3f}  {100 * core:+.1f} % of a core")


if __name__ == "__main__":
    main()
