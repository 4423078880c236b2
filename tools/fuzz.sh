#!/usr/bin/env bash
# Fuzzes all targets for SECONDS each (60 unless given), or those named after it, and prints a table of what was executed:
#
#     tools/fuzz.sh [SECONDS [TARGET...]]
#
# Ends with status 1 if a target panicked, took more than 10 s or more than 2 GB for one input; the input is then in fuzz/artifacts/.
# Needs cargo-fuzz (`cargo install cargo-fuzz`) and a C++ compiler. Uses a nightly Rust where there is one. The variable SANITIZER
# names one, such as `address`; without one it is many times faster. New inputs are kept in target/fuzz-corpus, not in the tree.
set -uo pipefail
cd "$(dirname "$0")/.."

seconds=${1:-60}
shift || true
targets=("$@")
if [ ${#targets[@]} = 0 ]; then
    mapfile -t targets < <(basename -s .rs -a fuzz/fuzz_targets/*.rs)
fi
sanitizer=${SANITIZER:-none}
toolchain=()
if rustup toolchain list 2>/dev/null | grep -q '^nightly'; then
    toolchain=(+nightly)
else
    export RUSTC_BOOTSTRAP=1
fi
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/fuzz
found=$CARGO_TARGET_DIR/../fuzz-corpus
# Files of the targets are many and small; in memory they cost little.
if [ -z "${TMPDIR:-}" ] && [ -w /dev/shm ]; then
    export TMPDIR=/dev/shm
fi
cargo "${toolchain[@]}" fuzz build -s "$sanitizer" || exit 1
programs=$CARGO_TARGET_DIR/$(rustc -vV | sed -n 's/^host: //p')/release

printf '%-20s %12s %10s %10s %12s  %s\n' target executions exec/s 'peak MB' 'slowest, s' result
total=0
failed=0
for target in "${targets[@]}"; do
    mkdir -p "$found/$target"
    log=$found/$target.log
    mkdir -p "fuzz/artifacts/$target"
    # Not through cargo, which would build anew if a source has changed meanwhile.
    "$programs/$target" "$found/$target" "fuzz/corpus/$target" -artifact_prefix="fuzz/artifacts/$target/" \
        -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 >"$log" 2>&1
    status=$?
    number() { sed -n "s/^stat::$1: *//p" "$log" | tail -1; }
    executions=$(number number_of_executed_units)
    total=$((total + ${executions:-0}))
    result=ok
    if [ "$status" != 0 ]; then
        failed=1
        result="failed: $(grep -m1 -E 'panicked at|libFuzzer: (timeout|out-of-memory)' "$log" | tr -s ' ' | cut -c1-100)"
    fi
    printf '%-20s %12s %10s %10s %12s  %s\n' "$target" "${executions:-?}" "$(number average_exec_per_sec)" \
        "$(number peak_rss_mb)" "$(number slowest_unit_time_sec)" "$result"
done
echo "$total executions"
exit "$failed"
