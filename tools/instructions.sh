#!/usr/bin/env bash
# Counts the instructions that a frame takes on aarch64, and writes docs/results/data/instructions.json.
#
#   tools/instructions.sh PROGRAM [ARGUMENTS of yfslam-bench measure, such as --data DIR]
#
# PROGRAM is the aarch64 program of tools/dist.sh. Needs Debian's package qemu-user and a C compiler.
set -euo pipefail
export YFSLAM_AARCH64
YFSLAM_AARCH64=$(realpath "$1")
shift
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export YFSLAM_COUNT_PLUGIN=$work/count.so
cc -shared -fPIC -O2 -o "$YFSLAM_COUNT_PLUGIN" tools/count_instructions.c
cargo run --release -p yfslam-bench -- measure instructions "$@"
