#!/usr/bin/env bash
# Ends run, map, bench and synth by TERM, INT and KILL at random moments, and checks what they leave: every file is whole, no half-made
# folder stays after TERM and INT, runs with checkpoints go on, and nothing panics.
#   tools/kills.sh [ROUNDS] [PROGRAM]         each round ends 12 programs; 9 rounds are 108
set -uo pipefail
cd "$(dirname "$0")/.."
rounds=${1:-9}
program=$(realpath "${2:-target/release/yfslam}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
RANDOM=7
world='walking_xyz?people=1&width=320&height=240&frames=90'
"$program" run "synth:$world" --method none --dense --out mapped -q > /dev/null || exit 1
kills=0 failures=0 resumed=0

fail() {
    echo "FAILED: $*"
    failures=$((failures + 1))
}

# Starts a command, sends the signal after 0 to 5 s, and sets `code`.
ended_by() {
    local signal=$1
    shift
    "$program" "$@" > stdout 2> stderr &
    local id=$!
    sleep "$(printf '%d.%03d' $((RANDOM % 5)) $((RANDOM % 1000)))"
    kill -"$signal" $id 2> /dev/null
    wait $id
    code=$?
    kills=$((kills + 1))
    grep -q panicked stderr && fail "$signal $*: $(grep panicked stderr)"
    case $signal:$code in
        TERM:143 | INT:130 | KILL:137 | *:0) ;;
        # Before any frame was tracked there is nothing to keep.
        *) fail "$signal $*: exit code $code: $(tail -1 stderr)" ;;
    esac
}

for ((round = 0; round < rounds; round++)); do
    for signal in TERM INT KILL; do
        rm -rf out
        arguments=(run "synth:$world" --method none --out out --checkpoint 0.05 --save-map room.map)
        ended_by $signal "${arguments[@]}"
        for json in out/run.json out/checkpoint.json; do
            if [ -e $json ] && ! python3 -m json.tool $json > /dev/null; then fail "$signal run: $json is not whole"; fi
        done
        if [ -e out/checkpoint.json ]; then
            "$program" "${arguments[@]}" --resume -q > stdout 2> stderr || fail "--resume after $signal: $(tail -1 stderr)"
            resumed=$((resumed + 1))
        fi
        ended_by $signal map mapped
        ended_by $signal synth "$world" --out rec
        if [ $signal != KILL ] && ls -d .*tmp > /dev/null 2>&1; then fail "$signal synth leaves $(ls -d .*tmp)"; fi
        # After KILL the next start removes it.
        rm -rf rec .*.tmp
        ended_by $signal bench "$world" --methods none --seeds 1 --out bench
        rm -rf bench
    done
done
echo "$kills kills, $resumed runs went on from their checkpoint, $failures failures"
[ $failures = 0 ]
