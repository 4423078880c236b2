#!/usr/bin/env bash
# Builds the static programs to hand out, for x86-64 and aarch64, into the folder OUT, with their SHA-256.
#
#   tools/dist.sh OUT
#
# Needs the targets of rustup (`rustup target add x86_64-unknown-linux-musl aarch64-unknown-linux-musl`), and for aarch64 the linker of
# Debian's package gcc-aarch64-linux-gnu. The same sources give the same bytes in every folder: paths are left out.
set -euo pipefail
out=$(mkdir -p "$1" && realpath "$1")
cd "$(dirname "$0")/.."
most=12000000

cargo_home=${CARGO_HOME:-$HOME/.cargo}
flags="-C target-feature=+crt-static --remap-path-prefix=$PWD=yfslam --remap-path-prefix=$cargo_home=cargo"
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER=aarch64-linux-gnu-gcc
for machine in x86_64 aarch64; do
    target=$machine-unknown-linux-musl
    RUSTFLAGS=$flags cargo build --locked --profile dist --target "$target" -p yfslam-cli
    program=${CARGO_TARGET_DIR:-target}/$target/dist/yfslam
    size=$(stat -c %s "$program")
    if [ "$size" -ge $most ]; then
        echo "$target: $size bytes, must be below $most" >&2
        exit 1
    fi
    install -m 755 "$program" "$out/yfslam-$target"
    echo "$target: $size bytes"
done
cd "$out"
sha256sum yfslam-* | tee SHA256SUMS
