#!/usr/bin/env bash
# A robot's day over a real ROS 2: a map is made and saved, becomes files for nav2, and is localised in on the next day.
#   tools/ros2/day.sh VENV RECORDING OUT       after cargo build --release && cargo build --release -p yfslam-ros2
set -euo pipefail
venv=$1 recording=$2 out=$3
here=$(dirname "$0")
programs=${PROGRAMS:-target/release}
drive=("$venv/bin/python" "$here/drive.py" --node "$programs/yfslam-ros2" --recording "$recording")
mkdir -p "$out"

echo "1. Drive with a live grid, and call save_map"
"${drive[@]}" --out "$out/today" > "$out/today.json"
test -s "$out/today/ros.map"

echo "2. The map as files for nav2's map_server"
"$programs/yfslam" map "$out/today/ros.map" --grid --out "$out/nav2" -q
grep -q '^resolution: 0.05' "$out/nav2/grid.yaml"
head -c 2 "$out/nav2/grid.pgm" | grep -q P5

echo "3. The next day: localise in the map, which stays as it is"
"${drive[@]}" --out "$out/tomorrow" --frames 200 -p "load_map:=$out/today/ros.map" -p localise_only:=true -p grid:=false > "$out/tomorrow.json"

"$venv/bin/python" - "$out" <<'PY'
import json, pathlib, sys
out = pathlib.Path(sys.argv[1])
def poses(day):
    rows = [line.split() for line in (out / day / "pose.txt").read_text().splitlines()]
    return {row[0]: [float(v) for v in row[1:4]] for row in rows}
today, tomorrow = poses("today"), poses("tomorrow")
both = [sum((a - b) ** 2 for a, b in zip(today[t], tomorrow[t])) for t in tomorrow if t in today]
tracked = json.loads((out / "tomorrow.json").read_text())["diagnostics"]
print(f"localised in {tracked['frames with a pose']} of {tracked['frames']} frames;",
      f"{(sum(both) / len(both)) ** 0.5:.3f} m RMSE from the poses of the day before in the same frame, without alignment")
PY
