#!/bin/sh
# Every check of the project, on Linux, macOS and Windows (Git Bash): format, lints, packages, features,
# documentation, the builds for a microcontroller (no_std) and for the browser, and all tests.
#
#   scripts/test.sh         everything
#   scripts/test.sh quick   before a commit: format, lints, unit tests, the kernels' twins on the CPU,
#                           one short run
#
# MTE_SLAM_REQUIRE_GPU=1      tests that find no adapter fail instead of using the CPU engine alone
# MTE_SLAM_REQUIRE_TARGETS=1  fail, not skip, where no compiler for the two other targets can be had
# MTE_SLAM_REQUIRE_BROWSER=1  fail, not skip, where there is no Chromium or no Node
# MTE_SLAM_REQUIRE_PYTHON=1   fail, not skip, where no Python 3 has tests/requirements.txt
# MTE_SLAM_REQUIRE_SNAKEMAKE=1  fail, not skip, where there is no Snakemake
# MTE_SLAM_REQUIRE_WASM_PACK=1  fail, not skip, where there is no wasm-pack
# MTE_SLAM_LINT_TOOLCHAIN     fail where the compiler's version does not begin so (1.95): lints change
#                             with it. Not in a rust-toolchain.toml, which would make everybody
#                             download that compiler, or fail where it cannot be had.
# MTE_SLAM_CROSS              see scripts/wasm-toolchain.sh
set -eu
cd "$(dirname "$0")/.."
case ${1:-all} in
    all | quick) what=${1:-all} ;;
    *)
        echo "test: found '$1', expected quick or nothing" >&2
        exit 2
        ;;
esac

started=$(date +%s)
begun=$started
current=
target=${CARGO_TARGET_DIR:-$PWD/target}

# step NAME: closes the step before and opens the next.
step() {
    now=$(date +%s)
    if [ -n "$current" ]; then echo "== $current: passed in $((now - begun)) s"; fi
    current=$1
    begun=$now
    if [ -n "$1" ]; then echo "== $1"; fi
}
finish() {
    step ""
    echo "== all checks passed in $(($(date +%s) - started)) s"
}
aside=
# shellcheck disable=SC2154  # status is set in the trap itself
trap 'status=$?
    if [ -n "$aside" ]; then kill "$aside" 2>/dev/null || true; fi
    if [ $status -ne 0 ]; then echo "== ${current:-start}: FAILED" >&2; fi' EXIT

step "format"
cargo fmt --all --check
cargo fmt --manifest-path fuzz/Cargo.toml --check
cargo fmt --manifest-path scripts/bindgen/Cargo.toml --check

step "lints"
if [ -n "${MTE_SLAM_LINT_TOOLCHAIN:-}" ]; then
    case $(rustc --version) in
        "rustc $MTE_SLAM_LINT_TOOLCHAIN"*) ;;
        *)
            echo "found $(rustc --version), expected $MTE_SLAM_LINT_TOOLCHAIN" >&2
            exit 1
            ;;
    esac
fi
cargo clippy --locked --workspace --all-targets -- -D warnings

if [ "$what" = quick ]; then
    step "unit tests"
    cargo test --locked --workspace --lib --bins --no-fail-fast

    step "the kernels' twins on the CPU"
    MTE_SLAM_NO_GPU=1 MTE_SLAM_REQUIRE_GPU=0 \
        cargo test --locked --workspace --test consistency --test gradients --no-fail-fast

    step "a short run"
    out=$(mktemp -d)
    # All of the workspace, here as above: one crate alone has other features, and would compile anew.
    cargo build --locked --workspace --bins
    "$target/debug/mte-slam" demo --out "$out/demo" --engine cpu --preset fast \
        --frames 4 --width 64 --set mapping.rays=400 --set mapping.first_iterations=60 \
        --set mapping.iterations=4 --set mapping.final_iterations=2 \
        --set mapping.semantic_iterations=40 --set field.surface_fine_m=0.06 \
        --set mesh.min_component_triangles=1 --mesh-resolution 0.1 --mesh-views 20
    for file in trajectory.txt mesh.ply metrics.json checkpoint.safetensors; do
        [ -s "$out/demo/$file" ] || { echo "the run wrote no $file" >&2; exit 1; }
    done
    rm -r "$out"
    finish
    exit 0
fi

step "packages"
have_python=0
if python3 -c '' 2>/dev/null; then
    have_python=1
    python3 scripts/packages.py
elif [ "${MTE_SLAM_REQUIRE_PYTHON:-0}" = 1 ]; then
    echo "no python3" >&2
    exit 1
else
    echo "SKIPPED: the checks of packages and features; there is no python3."
fi

step "compiler for no_std and wasm32"
cross=0
setup=$(sh ./scripts/wasm-toolchain.sh) || cross=$?
if [ $cross -eq 3 ] && [ "${MTE_SLAM_REQUIRE_TARGETS:-0}" != 1 ]; then
    echo "SKIPPED: the no_std and wasm32 builds. Neither rustup nor Debian's packages provide" \
        "their targets here; 'rustup target add wasm32-unknown-unknown thumbv7em-none-eabi' does."
elif [ $cross -ne 0 ]; then
    echo "no compiler for thumbv7em-none-eabi and wasm32-unknown-unknown (status $cross)" >&2
    exit 1
fi

# Beside the steps that follow, in folders of their own: one crate after the other, and linking the
# browser's module, take one core for long, while tests leave one idle now and then.
aside() {
    if [ $have_python -eq 1 ]; then CARGO_TARGET_DIR=$target/features python3 scripts/features.py; fi
    if [ $cross -eq 0 ]; then ./scripts/test-web.sh build; fi
}
aside >"$target/aside.log" 2>&1 &
aside=$!

step "documentation"
RUSTDOCFLAGS="${RUSTDOCFLAGS:-} -Dwarnings" cargo doc --locked --no-deps --workspace

if [ $cross -eq 0 ]; then
    step "no_std for thumbv7em-none-eabi, and wasm32"
    (
        eval "$setup"
        cargo check --locked -p mte-slam-core -p mte-slam-metrics -p mte-slam-synth \
            --no-default-features --target thumbv7em-none-eabi
        cargo check --locked -p mte-slam-web --target wasm32-unknown-unknown
    )
fi

# Their targets are not run here, but kept in order; scripts/fuzz.sh runs them.
step "fuzz targets"
(
    cd fuzz
    export RUSTFLAGS="${RUSTFLAGS:-} --cfg fuzzing" CARGO_TARGET_DIR="$target/fuzz"
    cargo clippy --locked --no-default-features --all-targets -- -D warnings
    cargo test --locked --no-default-features --lib
)

# With the examples in the documentation.
step "tests"
cargo test --locked --workspace --no-fail-fast

step "workflow"
# The program that the tests have built.
MTE_SLAM=$target/debug/mte-slam ./scripts/test-workflow.sh

step "features, and the build for a browser"
built=0
wait "$aside" || built=$?
aside=
cat "$target/aside.log"
[ $built -eq 0 ] || exit 1

if [ $cross -eq 0 ]; then
    step "tests in a browser"
    ./scripts/test-web.sh run
fi

finish
