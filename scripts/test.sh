#!/bin/sh
# Every check of the project, on Linux, macOS and Windows (Git Bash): format, lints, documentation,
# the builds for a microcontroller (no_std) and for the browser, and all tests.
#
# MTE_SLAM_REQUIRE_GPU=1      tests that find no adapter fail instead of using the CPU engine alone
# MTE_SLAM_REQUIRE_TARGETS=1  fail, not skip, where no compiler for the two other targets can be had
# MTE_SLAM_REQUIRE_BROWSER=1  fail, not skip, where there is no Chromium or no Node
# MTE_SLAM_REQUIRE_PYTHON=1   fail, not skip, where no Python 3 has numpy and Pillow
# MTE_SLAM_REQUIRE_SNAKEMAKE=1  fail, not skip, where there is no Snakemake
# MTE_SLAM_CROSS              see scripts/wasm-toolchain.sh
set -eu
cd "$(dirname "$0")/.."

started=$(date +%s)
begun=$started
current=

# step NAME: closes the step before and opens the next.
step() {
    now=$(date +%s)
    if [ -n "$current" ]; then echo "== $current: passed in $((now - begun)) s"; fi
    current=$1
    begun=$now
    if [ -n "$1" ]; then echo "== $1"; fi
}
trap 'status=$?; if [ $status -ne 0 ]; then echo "== ${current:-start}: FAILED" >&2; fi' EXIT

step "format"
cargo fmt --all --check

step "lints"
cargo clippy --locked --workspace --all-targets -- -D warnings

step "documentation"
RUSTDOCFLAGS="${RUSTDOCFLAGS:-} -Dwarnings" cargo doc --locked --no-deps --workspace

# Not run here, but kept in order; scripts/fuzz.sh runs them.
step "fuzz targets"
(
    cd fuzz
    cargo fmt --check
    RUSTFLAGS="${RUSTFLAGS:-} --cfg fuzzing" cargo clippy --locked --no-default-features --all-targets \
        --target-dir "${CARGO_TARGET_DIR:-../target}/fuzz" -- -D warnings
    RUSTFLAGS="${RUSTFLAGS:-} --cfg fuzzing" cargo test --locked --no-default-features --lib \
        --target-dir "${CARGO_TARGET_DIR:-../target}/fuzz"
)

step "compiler for no_std and wasm32"
cross=0
setup=$(sh ./scripts/wasm-toolchain.sh) || cross=$?
if [ $cross -eq 0 ]; then
    step "no_std build of the core for thumbv7em-none-eabi"
    (
        eval "$setup"
        cargo build --locked -p mte-slam-core -p mte-slam-metrics -p mte-slam-synth --no-default-features --target thumbv7em-none-eabi
    )
    step "wasm32 build of the browser bindings"
    (
        eval "$setup"
        cargo build --locked -p mte-slam-web --target wasm32-unknown-unknown
    )
elif [ $cross -eq 3 ] && [ "${MTE_SLAM_REQUIRE_TARGETS:-0}" != 1 ]; then
    echo "SKIPPED: the no_std and wasm32 builds. Neither rustup nor Debian's packages provide" \
        "their targets here; 'rustup target add wasm32-unknown-unknown thumbv7em-none-eabi' does."
else
    echo "no compiler for thumbv7em-none-eabi and wasm32-unknown-unknown (status $cross)" >&2
    exit 1
fi

step "examples in the documentation"
cargo test --locked --workspace --doc

step "tests"
cargo test --locked --workspace --all-targets --no-fail-fast

step "workflow"
./scripts/test-workflow.sh

# The page and the kernels in a browser. Needs the compiler for wasm32 from above.
if [ $cross -eq 0 ]; then
    step "tests in a browser"
    ./scripts/test-web.sh
fi

step ""
echo "== all checks passed in $(($(date +%s) - started)) s"
