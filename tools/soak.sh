#!/usr/bin/env bash
# Tracks a camera that goes around a corridor with people again and again, with a dense map and checkpoints, and writes the memory of the
# process every ten seconds.
#   tools/soak.sh SECONDS OUT.tsv [PROGRAM]
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=$1
table=$(realpath -m "$2")
program=$(realpath "${3:-target/release/yfslam}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Ten hours at 30 Hz; the signal below ends the run before.
"$program" run 'synth:corridor_loop?people=2&width=320&height=240&frames=1080000' --dense --checkpoint 600 --out "$work/out" -q &
id=$!
printf 'seconds\trss_mb\tthreads\tdescriptors\n' > "$table"
for ((t = 10; t <= seconds; t += 10)); do
    sleep 10
    [ -d /proc/$id ] || { echo "the run has ended by itself" >&2; exit 1; }
    rss=$(awk '/^VmRSS/ { print int($2 / 1024) }' /proc/$id/status)
    threads=$(awk '/^Threads/ { print $2 }' /proc/$id/status)
    printf '%d\t%d\t%d\t%d\n' "$t" "$rss" "$threads" "$(ls /proc/$id/fd | wc -l)" >> "$table"
done
kill -INT $id
wait $id || [ $? = 130 ]
tail -1 "$table"
