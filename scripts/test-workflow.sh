#!/bin/sh
# The Snakemake workflow with two local jobs on the suite `tiny`: all runs and the report are made,
# and a second start does nothing. Skipped where there is no Snakemake.
#
# MTE_SLAM_REQUIRE_SNAKEMAKE=1  fail, not skip, without Snakemake
# MTE_SLAM                      the program [default: built here]
set -eu
cd "$(dirname "$0")/.."

if ! command -v snakemake > /dev/null 2>&1; then
    if [ "${MTE_SLAM_REQUIRE_SNAKEMAKE:-0}" = 1 ]; then
        echo "no snakemake; 'pip install -r tests/requirements.txt' brings it" >&2
        exit 1
    fi
    echo "SKIPPED: the workflow; there is no snakemake ('pip install -r tests/requirements.txt' brings it)."
    exit 0
fi
if [ -z "${MTE_SLAM:-}" ]; then
    cargo build --locked --quiet -p mte-slam
    MTE_SLAM=${CARGO_TARGET_DIR:-$PWD/target}/debug/mte-slam
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
out=$work/out

# Snakemake keeps its own notes (.snakemake) in the working directory.
start() {
    snakemake --snakefile native/workflows/Snakefile --directory "$work" --cores 2 --quiet all "$@" \
        --config program="$MTE_SLAM" suite=tiny out="$out" threads=1
}

start
for file in report.html report.md results.json results.csv; do
    [ -s "$out/$file" ] || { echo "$file was not made" >&2; exit 1; }
done
runs=$(ls "$out"/runs/*/metrics.json | wc -l)
[ "$runs" -eq 2 ] || { echo "found $runs finished runs, expected 2" >&2; exit 1; }

# Nothing is done twice, by Snakemake or by the program itself.
stamps() { find "$out" -type f -exec stat -c '%n %Y' {} + | sort; }
before=$(stamps)
sleep 1
start
"$MTE_SLAM" -q evaluate tiny --out "$out"
[ "$before" = "$(stamps)" ] || { echo "a second start wrote files" >&2; exit 1; }

# One run that is gone is made again, alone.
rm -r "$out/runs/office.fast.base.seed1" "$out/done/office.fast.base.seed1" "$out/report.html"
kept=$(stat -c %Y "$out/runs/room.fast.base.seed1/metrics.json")
start
[ -s "$out/runs/office.fast.base.seed1/metrics.json" ] && [ -s "$out/report.html" ]
[ "$kept" = "$(stat -c %Y "$out/runs/room.fast.base.seed1/metrics.json")" ]
echo "the workflow made two runs and the report, and nothing twice"
