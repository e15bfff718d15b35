#!/bin/sh
# Runs the fuzz targets (fuzz/fuzz_targets) one after the other, each on inputs that start from small
# valid files. Anything but an error of ours (a panic, more than 10 s, more than 1 GiB) stops it.
#
#   scripts/fuzz.sh [TARGET|all] [SECONDS]     default: all targets, 60 s each
#   scripts/fuzz.sh --build                    builds them, and writes the first inputs
#   scripts/fuzz.sh --list                     names them
#
# Needs cargo-fuzz (`cargo install cargo-fuzz`) and a C++ compiler. No nightly compiler is needed, as
# no sanitizer is used: the readers have no unsafe code, and memory is limited in the allocator.
set -eu
cd "$(dirname "$0")/../fuzz"

targets=$(sed -n '/^\[\[bin\]\]/,/^$/s/^name = "\(.*\)"/\1/p' Cargo.toml)
target=${1:-all}
seconds=${2:-60}
if [ "$target" = --list ]; then
    echo "$targets"
    exit 0
fi
command -v cargo-fuzz >/dev/null || {
    echo "fuzz: there is no cargo-fuzz; 'cargo install cargo-fuzz' provides it" >&2
    exit 1
}
export RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"

mkdir -p artifacts

build() {
    cargo fuzz build --fuzz-dir . --sanitizer none
    [ -d corpus ] || cargo run --quiet --release --example seeds -- corpus
}
case $target in
    --build)
        build
        exit 0
        ;;
    all) ;;
    *)
        # shellcheck disable=SC2086  # a list of words
        printf '%s\n' $targets | grep -qx "$target" || {
            echo "fuzz: no target '$target'; there are:" $targets >&2
            exit 2
        }
        targets=$target
        ;;
esac
build
for target in $targets; do
    echo "== $target: $seconds s"
    "$CARGO_TARGET_DIR/$(rustc -vV | sed -n 's/^host: //p')/release/$target" \
        -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=65536 -print_final_stats=1 \
        -artifact_prefix="artifacts/$target-" "corpus/$target"
done
