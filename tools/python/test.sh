#!/usr/bin/env bash
# Tests the Python package as a user has it: builds the wheel, installs it in a new virtual environment, checks the types and runs the
# tests. With YFSLAM_DATA, recordings are compared with the program, byte for byte.
#   tools/python/test.sh       needs python3 with venv; PYTHON names another interpreter
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
python=$work/venv/bin/python
# The SDK of RealSense cameras, Rerun and evo, for the tests of the extras; Open3D is tested where it is installed.
"$python" -m pip install --quiet --disable-pip-version-check 'maturin>=1.9,<2' numpy pytest mypy pyrealsense2 rerun-sdk evo
(cd crates/yfslam-py && "$work/venv/bin/maturin" build --release --quiet --out "$work/wheels" --interpreter "$python")
"$python" -m pip install --quiet --disable-pip-version-check "$work"/wheels/*.whl
ls -l "$work"/wheels
cd crates/yfslam-py
"$python" -m mypy --strict --config-file pyproject.toml -p yfslam
"$python" -m mypy --strict --config-file pyproject.toml ../../examples/python/*.py
"$python" -m mypy.stubtest yfslam._yfslam --allowlist tests/stubtest-allowlist.txt
"$python" -m pytest -q -p no:cacheprovider "$@"
(cd "$work" && for example in "$OLDPWD"/../../examples/python/*.py; do "$python" "$example"; done)
