#!/usr/bin/env bash
# Runs the program over a fixed list of recordings and rendered worlds and prints the SHA-256 of every trajectory, map and product.
#
#   tools/golden.sh YFSLAM DATA OUT > hashes.txt         DATA as in CONTRIBUTING.md, OUT a folder that is made
#   tools/golden.sh YFSLAM DATA OUT | diff tools/golden.sha256 -
#
# A change that must not alter results leaves every line as it is. The hashes in golden.sha256 hold for x86-64 processors with AVX2; for others
# see tools/same_bits.sh. Files that hold times (run.json, report.html) or help texts (config.toml) are left out.
set -euo pipefail
yfslam=$(realpath "$1")
data=$(realpath "$2")
mkdir -p "$3"
cd "$3"

tum=$data/rgbd/tum_fr1_xyz_dev
bonn=$data/rgbd/bonn_crowd_dev
official=$data/models/yolo-fastestv2-coco.onnx

run() { # NAME ARGUMENTS...
    local name=$1
    shift
    echo "golden: $name" >&2
    "$yfslam" run "$@" --out "$name" --quiet > "$name.log" 2>&1 || { cat "$name.log" >&2; exit 1; }
}

run tum_none_full "$tum" --method none,full
run tum_backward "$tum" --reverse --method full
run bonn_all "$bonn" --method none,boxes,yf,ds,dyna,dms,full
run bonn_backward "$bonn" --reverse --method full
run bonn_ransac "$bonn" --method yf --grouping ransac --seed 3
run bonn_every_third "$bonn" --detect-every 3 --end 300
run tum_mono "$tum" --sensor mono
run bonn_mono "$bonn" --sensor mono
for world in sitting_xyz walking_static walking_halfsphere pushed_chair crowd corridor_loop dark_rescue; do
    run "world_$world" "synth:$world?frames=90&seed=2" --method none,yf,full
done
run world_network 'synth:walking_xyz?frames=60&seed=3' --detector embedded
run world_stereo 'synth:walking_xyz?frames=90&stereo=0.11' --method none,boxes,yf,full
run world_mono 'synth:walking_xyz?frames=150&seed=4' --sensor mono
run world_loop 'synth:corridor_loop?people=0&width=320&height=240&frames=1330&fps=30' --method full
run world_faults 'synth:walking_xyz?frames=120&seed=5' --fault covered@2+1 --fault dropped@1+0.3

# Saved maps: made, extended, localised in.
run map_first "$bonn" --end 300 --dense --save-map first.map
run map_second "$bonn" --start 300 --dense --load-map first.map --save-map second.map
run map_localise "$bonn" --start 100 --end 250 --load-map second.map --localise
"$yfslam" map second.map --out products_second --quiet > products_second.log 2>&1
"$yfslam" map map_first --resolution 0.1 --out products_first --quiet > products_first.log 2>&1
run dense_classes "$bonn" --end 150 --dense --detector "$official" --overlay
"$yfslam" map dense_classes --out products_classes --quiet > products_classes.log 2>&1
"$yfslam" detect "$bonn/rgb" --detector "$official" --out detections --quiet > detections.log 2>&1

find . -type f ! -name run.json ! -name report.html ! -name config.toml ! -name '*.log' -print0 |
    LC_ALL=C sort -z | xargs -0 sha256sum
