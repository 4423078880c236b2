#!/usr/bin/env bash
# Builds the C library and installs it: tools/capi/install.sh PREFIX
# Afterwards PREFIX has include/yfslam.h and yfslam.hpp, lib/libyfslam.so or .dylib, lib/libyfslam.a, and the files for CMake and pkg-config.
set -euo pipefail
prefix=${1:?"give the folder to install to, such as /usr/local"}
cd "$(dirname "$0")/../.."
source=crates/yfslam-capi
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
abi=$(sed -n 's/^#define YFSLAM_ABI_VERSION //p' $source/include/yfslam.h)

cargo build --release -p yfslam-capi
built=${CARGO_TARGET_DIR:-target}/release

mkdir -p "$prefix/include" "$prefix/lib/cmake/yfslam" "$prefix/lib/pkgconfig"
cp $source/include/yfslam.h $source/include/yfslam.hpp "$prefix/include/"
cp "$built/libyfslam_c.a" "$prefix/lib/libyfslam.a"
if [ "$(uname)" = Darwin ]; then
    file=libyfslam.$abi.dylib
    soname_line=
    cp "$built/libyfslam_c.dylib" "$prefix/lib/$file"
    ln -sf "$file" "$prefix/lib/libyfslam.dylib"
else
    # The name that programs ask for at run time is libyfslam.so.ABI (build.rs).
    file=libyfslam.so.$version
    soname_line="IMPORTED_SONAME libyfslam.so.$abi"
    cp "$built/libyfslam_c.so" "$prefix/lib/$file"
    ln -sf "$file" "$prefix/lib/libyfslam.so.$abi"
    ln -sf "libyfslam.so.$abi" "$prefix/lib/libyfslam.so"
fi
fill() {
    sed -e "s/@VERSION@/$version/" -e "s/@SHARED_FILE@/$file/" -e "s/@SONAME_LINE@/$soname_line/" "$1" > "$2"
}
fill $source/cmake/yfslamConfig.cmake.in "$prefix/lib/cmake/yfslam/yfslamConfig.cmake"
fill $source/cmake/yfslamConfigVersion.cmake.in "$prefix/lib/cmake/yfslam/yfslamConfigVersion.cmake"
fill $source/cmake/yfslam.pc.in "$prefix/lib/pkgconfig/yfslam.pc"
echo "installed yfslam $version to $prefix"
