#!/usr/bin/env bash
# Checks that other processors give the same trajectories as this one, byte for byte.
#
#   tools/same_bits.sh PROGRAMS [RECORDING...]
#
# PROGRAMS is the folder of tools/dist.sh. The x86-64 program runs here, and in qemu as a processor of 2008 (SSE4.2), of 2013 (AVX2, FMA)
# and without any extension beyond SSE2; the aarch64 program in qemu; example 07 here and as WebAssembly in wasmtime. Needs Debian's package
# qemu-user, PyPI's wasmtime, and for WebAssembly `rustup target add wasm32-wasip1`. What is not installed is left out, and said.
# Recordings are run over their first 40 frames, with the embedded network. Rendering in qemu takes minutes for each processor.
set -euo pipefail
programs=$(realpath "$1")
shift
recordings=()
for recording in "$@"; do recordings+=("$(realpath "$recording")"); done
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
x86=$programs/yfslam-x86_64-unknown-linux-musl
arm=$programs/yfslam-aarch64-unknown-linux-musl
failed=0 compared=0

# NAME COMMAND...: the SHA-256 of all trajectories that the program behind COMMAND makes.
hash_of() {
    local name=$1
    shift
    local out=$work/$name
    "$@" run 'synth:walking_xyz?frames=20&width=320&height=240&seed=5' --method none,yf,full --out "$out/world" --quiet > "$out.log" 2>&1
    "$@" run 'synth:walking_xyz?frames=10&width=320&height=240&seed=3' --detector embedded --out "$out/network" --quiet >> "$out.log" 2>&1
    "$@" run 'synth:walking_xyz?frames=10&width=320&height=240&stereo=0.11' --out "$out/stereo" --quiet >> "$out.log" 2>&1
    local recording
    for recording in ${recordings[@]+"${recordings[@]}"}; do
        "$@" run "$recording" --end 40 --method full --detector embedded --out "$out/$(basename "$recording")" --quiet >> "$out.log" 2>&1
    done
    (cd "$out" && find . -name trajectory.txt | sort | xargs sha256sum | sha256sum | cut -c1-16)
}

compare() { # NAME HASH
    compared=$((compared + 1))
    if [ "$2" = "$expected" ]; then
        echo "same       $1"
    else
        echo "different  $1"
        failed=1
    fi
}

expected=$(hash_of here "$x86")
echo "reference  x86-64 here: $expected"
if command -v qemu-x86_64 > /dev/null; then
    compare "x86-64, SSE4.2 (Nehalem)" "$(hash_of nehalem qemu-x86_64 -cpu Nehalem "$x86")"
    compare "x86-64, AVX2 and FMA (Haswell)" "$(hash_of haswell qemu-x86_64 -cpu Haswell "$x86")"
    compare "x86-64, SSE2 only" "$(hash_of sse2 qemu-x86_64 -cpu qemu64,-ssse3,-sse4.1,-sse4.2,-popcnt "$x86")"
else
    echo "left out   other x86-64 processors: no qemu-x86_64"
fi
if command -v qemu-aarch64 > /dev/null && [ -x "$arm" ]; then
    compare "aarch64" "$(hash_of aarch64 qemu-aarch64 "$arm")"
else
    echo "left out   aarch64: no qemu-aarch64, or no program"
fi

if rustup target list --installed 2> /dev/null | grep -qx wasm32-wasip1 && python3 -c 'import wasmtime' 2> /dev/null; then
    example=(-p yfslam-examples --example 07_any_machine)
    cargo run --quiet --release "${example[@]}" > "$work/here.txt"
    cargo build --quiet --release --target wasm32-wasip1 "${example[@]}"
    python3 tools/run_wasm.py "${CARGO_TARGET_DIR:-target}/wasm32-wasip1/release/examples/07_any_machine.wasm" > "$work/wasm.txt"
    expected=$(sha256sum < "$work/here.txt")
    compare "WebAssembly, example 07 ($(wc -l < "$work/here.txt") poses)" "$(sha256sum < "$work/wasm.txt")"
else
    echo "left out   WebAssembly: no target wasm32-wasip1, or no wasmtime for python3"
fi
echo "$compared compared"
exit $failed
