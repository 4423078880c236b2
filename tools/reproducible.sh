#!/usr/bin/env bash
# Builds the program in two folders, from clean copies of the last commit, and compares the two files.
#   tools/reproducible.sh
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for copy in first the-second-one; do
    mkdir -p "$work/$copy"
    git archive HEAD | tar -x -C "$work/$copy"
    (
        cd "$work/$copy"
        cargo_home=${CARGO_HOME:-$HOME/.cargo}
        export RUSTFLAGS="--remap-path-prefix=$PWD=/yfslam --remap-path-prefix=$cargo_home=/cargo"
        CARGO_TARGET_DIR=$PWD/target cargo build --release --locked --quiet
    )
done
sha256sum "$work"/*/target/release/yfslam
cmp "$work/first/target/release/yfslam" "$work/the-second-one/target/release/yfslam"
echo "both builds are equal"
