#!/bin/sh
# Tests of the browser's part, in headless Chromium with WebGPU in software: every kernel and a short
# run against the native CPU engine's results, then the page as people use it. Builds what it needs.
#
# MTE_SLAM_CHROMIUM         the browser (default: chromium or google-chrome in the usual places)
# MTE_SLAM_DATA             a folder with room-11 and kitchen-7scenes (default: shared/data in the
#                           repository or beside it); without it tests with real files are skipped
# MTE_SLAM_REQUIRE_BROWSER=1  fail, not skip, where there is no browser or no Node
set -eu
cd "$(dirname "$0")/.."

missing=
command -v node >/dev/null && command -v npm >/dev/null || missing="Node 20 or newer"
if [ -z "${MTE_SLAM_CHROMIUM:-}" ]; then
    for path in /usr/bin/chromium /usr/bin/chromium-browser /usr/bin/google-chrome; do
        if [ -x "$path" ]; then MTE_SLAM_CHROMIUM=$path; fi
    done
fi
[ -n "${MTE_SLAM_CHROMIUM:-}" ] || missing="${missing:+$missing and }Chromium (or MTE_SLAM_CHROMIUM)"
if [ -n "$missing" ]; then
    if [ "${MTE_SLAM_REQUIRE_BROWSER:-0}" = 1 ]; then
        echo "test-web: $missing is missing" >&2
        exit 1
    fi
    echo "SKIPPED: the tests in a browser need $missing."
    exit 0
fi
export MTE_SLAM_CHROMIUM

target=${CARGO_TARGET_DIR:-$PWD/target}
./scripts/build-web.sh

echo "== consistency: the kernels for the browser, and the native results"
cargo build --locked -p mte-slam
cargo run --locked --quiet -p mte-slam-tests --example kernel_outputs -- "$target/kernel_outputs.bin"
setup=$(sh ./scripts/wasm-toolchain.sh)
(
    eval "$setup"
    export CARGO_PROFILE_RELEASE_DEBUG=0 CARGO_TARGET_DIR="$target/web" \
        CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-C target-feature=+simd128"
    cargo rustc --locked --release -p mte-slam-tests --lib --crate-type cdylib \
        --target wasm32-unknown-unknown
)
bindgen=$(./scripts/bindgen.sh)
"$bindgen" --target web --no-typescript --out-dir "$target/web/consistency" \
    "$target/web/wasm32-unknown-unknown/release/mte_slam_tests.wasm"

cd www
MTE_SLAM_BIN=$target/debug/mte-slam MTE_SLAM_CONSISTENCY=$target/web/consistency \
    MTE_SLAM_REFERENCE=$target/kernel_outputs.bin \
    node --test --test-concurrency=1 --test-reporter=spec test/*.test.mjs
