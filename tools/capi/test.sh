#!/usr/bin/env bash
# Tests the C library as a user has it: builds and installs it to a new folder, builds the examples with CMake against it, and runs them with
# the address sanitizer and, where it is installed, with valgrind. With YFSLAM_DATA, the trajectory of a recording is compared with that of
# the program, byte for byte.
#   tools/capi/test.sh         needs cmake, a C and a C++ compiler, pkg-config and, for the second run, valgrind
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix
tools/capi/install.sh "$prefix"

echo "== the library exports what the header declares, and nothing else"
declared=$(sed 's|/\*.*\*/||' "$prefix/include/yfslam.h" | grep -o '\byfslam_[a-z0-9_]*(' | tr -d '(' | sort -u)
exported=$(nm -D --defined-only "$prefix/lib/libyfslam.so" | awk '$2 == "T" { print $3 }' | grep '^yfslam_' | sort -u)
diff <(echo "$declared") <(echo "$exported")
others=$(nm -D --defined-only "$prefix/lib/libyfslam.so" | awk '{ print $3 }' | grep -v '^yfslam_' || true)
test -z "$others" || { echo "other names are exported: $others"; exit 1; }

build() {
    for language in c cpp; do
        cmake -S examples/$language -B "$work/$1/$language" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
            -DCMAKE_C_FLAGS="$2" -DCMAKE_CXX_FLAGS="$2" > "$work/cmake.log" || { cat "$work/cmake.log"; exit 1; }
        cmake --build "$work/$1/$language"
    done
}
warnings="-Wall -Wextra -Wpedantic -Werror"

echo "== examples with the address and undefined behaviour sanitizers"
build sanitized "$warnings -fsanitize=address,undefined -fno-omit-frame-pointer"
"$work/sanitized/cpp/own_detector"
"$work/sanitized/c/track_recording" /nowhere && exit 1 || true

echo "== examples as a user builds them"
build plain "$warnings"
if command -v valgrind > /dev/null; then
    valgrind --quiet --error-exitcode=9 --leak-check=full --show-leak-kinds=definite,indirect --errors-for-leak-kinds=definite,indirect "$work/plain/cpp/own_detector"
fi

echo "== pkg-config"
cc -std=c99 examples/c/track_recording.c $(PKG_CONFIG_PATH="$prefix/lib/pkgconfig" pkg-config --cflags --libs yfslam) \
    -Wl,-rpath,"$prefix/lib" -o "$work/by_pkg_config"
"$work/by_pkg_config" /nowhere && exit 1 || true

data=${YFSLAM_DATA:-../shared/data}/rgbd/bonn_crowd_dev
if [ -d "$data" ]; then
    echo "== $(basename "$data"): C, C static and C++ give the trajectory of the program"
    cargo run --release --quiet -p yfslam-cli -- run "$data" --camera bonn -q -o "$work/run"
    for program in c/track_recording c/track_recording_static cpp/track_recording; do
        "$work/plain/$program" "$data" bonn "$work/trajectory.txt"
        cmp "$work/trajectory.txt" "$work/run/trajectory.txt"
    done
    "$work/sanitized/c/track_recording" "$data" bonn "$work/trajectory.txt"
    cmp "$work/trajectory.txt" "$work/run/trajectory.txt"
    "$work/plain/c/robot_loop" "$data" bonn
else
    echo "no recording at $data: the comparison with the program is skipped"
fi
echo "all tests of the C library passed"
