#!/bin/sh
# Tests of the browser's part, in headless Chromium with WebGPU in software: every kernel and a short
# run against the native CPU engine's results, then the page as people use it, and npm's package.
#
#   scripts/test-web.sh [build|run]   only builds what the tests need, or only runs them [both]
#
# MTE_SLAM_CHROMIUM         the browser (default: chromium or google-chrome in the usual places)
# MTE_SLAM_DATA             a folder with room-11 and kitchen-7scenes (default: shared/data in the
#                           repository or beside it); without it tests with real files are skipped
# MTE_SLAM_REQUIRE_BROWSER=1  fail, not skip, where there is no browser or no Node
# MTE_SLAM_REQUIRE_WASM_PACK=1  fail, not skip, where there is no wasm-pack
set -eu
cd "$(dirname "$0")/.."
what=${1:-both}

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

build() {
    ./scripts/build-web.sh
    if command -v wasm-pack >/dev/null; then
        # build-web.sh took it; the other way must give the same bytes.
        ./scripts/web-module.sh "$target/web/by-wasm-pack" wasm-pack
        ./scripts/web-module.sh "$target/web/by-cargo" cargo
        for file in mte_slam_web.js mte_slam_web.d.ts mte_slam_web_bg.wasm mte_slam_web_bg.wasm.d.ts; do
            cmp "$target/web/by-wasm-pack/$file" "$target/web/by-cargo/$file"
        done
        echo "test-web: wasm-pack and scripts/bindgen give the same bytes"
    elif [ "${MTE_SLAM_REQUIRE_WASM_PACK:-0}" = 1 ]; then
        echo "test-web: wasm-pack is missing" >&2
        exit 1
    else
        echo "SKIPPED: wasm-pack ('cargo install wasm-pack --locked' brings it)."
    fi

    # The test bodies as a module. Speed is what counts, and the tests' crate changes often.
    bindgen=$(./scripts/bindgen.sh)
    setup=$(sh ./scripts/wasm-toolchain.sh)
    (
        eval "$setup"
        export CARGO_PROFILE_RELEASE_DEBUG=0 CARGO_TARGET_DIR="$target/web" \
            CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-C target-feature=+simd128"
        cargo rustc --locked --release -p mte-slam-tests --lib --crate-type cdylib \
            --target wasm32-unknown-unknown
    )
    "$bindgen" --target web --no-typescript --out-dir "$target/web/consistency" \
        "$target/web/wasm32-unknown-unknown/release/mte_slam_tests.wasm"
}

# tests CONCURRENCY FILE...
tests() {
    files=
    concurrency=$1
    shift
    for name in "$@"; do files="$files test/$name.test.mjs"; done
    # shellcheck disable=SC2086  # a list of words
    (cd www && MTE_SLAM_BIN=$target/debug/mte-slam MTE_SLAM_CONSISTENCY=$target/web/consistency \
        MTE_SLAM_REFERENCE=$target/kernel_outputs.bin \
        node --test --test-concurrency="$concurrency" --test-reporter=spec $files)
}

run() {
    # As the tests build them: one crate alone has other features, and would compile everything anew.
    cargo test --locked --workspace --no-run
    "$target/debug/examples/kernel_outputs" "$target/kernel_outputs.bin"
    named="consistency failures package page resume sources tarball trajectories"
    found=$(cd www/test && echo *.test.mjs | sed 's/\.test\.mjs//g')
    [ "$named" = "$found" ] || { echo "test-web: found the tests $found, expected $named" >&2; exit 1; }
    # Two files at a time, the longest first: a run in WebAssembly has one thread.
    failed=0
    tests 2 consistency resume sources failures trajectories package tarball || failed=1
    # This one measures how quickly the page answers.
    tests 1 page || failed=1
    [ $failed -eq 0 ]
}

case $what in
    build) build ;;
    run) run ;;
    both)
        build
        run
        ;;
    *)
        echo "test-web: found '$what', expected build or run" >&2
        exit 2
        ;;
esac
