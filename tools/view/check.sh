#!/bin/sh
# Checks the live view and the recordings with programs that are not ours: Chromium, and readers of MCAP.
#
#   tools/view/check.sh [PROGRAM] [FOLDER FOR SCREENSHOTS]
#
# Needs Node.js and Python; installs Debian's chromium and ffmpeg (as root), playwright-core and the Python packages mcap and mcap-ros2-support by
# name. With YFSLAM_DATA (see CONTRIBUTING.md), a real recording is shown, too.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
program=${1:-$root/target/release/yfslam}
work=$root/target/view
mkdir -p "$work"
command -v chromium >/dev/null && command -v ffmpeg >/dev/null || apt-get install -y -qq chromium ffmpeg >/dev/null
[ -d "$work/node_modules/playwright-core" ] || npm install --prefix "$work" --no-package-lock --silent playwright-core
[ -d "$work/python" ] || { python3 -m venv "$work/python" && "$work/python/bin/pip" install -q mcap mcap-ros2-support; }
MODULES=$work node "$here/check.mjs" "$program" "${2:-$work/shots}"
"$work/python/bin/python" "$here/check_mcap.py" "$program"
