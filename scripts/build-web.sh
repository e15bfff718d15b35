#!/bin/sh
# Builds the page: the WebAssembly package into www/pkg, then www/dist, static files that work from
# any sub-path. Checks the size budget. Needs Rust with the wasm32 target and Node 20 or newer.
#
# MTE_SLAM_TOOLS   where wasm-bindgen is kept (default: the user's cache folder, by version)
set -eu
cd "$(dirname "$0")/.."
cache=${MTE_SLAM_TOOLS:-${XDG_CACHE_HOME:-$HOME/.cache}/mte-slam/tools}
limit_bytes=2500000
limit_gzip_bytes=900000

say() { echo "build-web: $*"; }

# wasm-bindgen's command must have exactly the library's version.
version=$(sed -n '/^name = "wasm-bindgen"$/{n;s/version = "\(.*\)"/\1/p;}' Cargo.lock)
bindgen=$(command -v wasm-bindgen || true)
if [ -z "$bindgen" ] || [ "$("$bindgen" --version)" != "wasm-bindgen $version" ]; then
    bindgen=$cache/wasm-bindgen-$version/bin/wasm-bindgen
    if [ ! -x "$bindgen" ]; then
        say "installing wasm-bindgen-cli $version into $cache (once)"
        CARGO_TARGET_DIR=$cache/build cargo install --quiet wasm-bindgen-cli --version "$version" \
            --root "$cache/wasm-bindgen-$version"
        rm -rf "$cache/build"
    fi
fi

setup=$(sh ./scripts/wasm-toolchain.sh)
target=$(
    eval "$setup"
    # Every browser that has WebGPU has 128-bit SIMD; it does not change a bit of the results.
    export CARGO_PROFILE_RELEASE_DEBUG=0 CARGO_PROFILE_RELEASE_LTO=fat \
        CARGO_PROFILE_RELEASE_CODEGEN_UNITS=1 CARGO_PROFILE_RELEASE_PANIC=abort \
        CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-C target-feature=+simd128 -C llvm-args=-inline-threshold=25" \
        CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}/web"
    # What runs once a frame at most is made small; the kernels' twins are not.
    set --
    for crate in core types odometry dataset mesh metrics synth; do
        set -- "$@" --config "profile.release.package.mte-slam-$crate.opt-level=2"
    done
    for crate in mte-slam-web mte-slam-run serde_json zip zune-jpeg image png fdeflate miniz_oxide wgpu js-sys serde-wasm-bindgen; do
        set -- "$@" --config "profile.release.package.$crate.opt-level='s'"
    done
    cargo build --locked --release "$@" -p mte-slam-web --target wasm32-unknown-unknown >&2
    echo "$CARGO_TARGET_DIR"
)
rm -rf www/pkg
"$bindgen" --target web --out-dir www/pkg "$target/wasm32-unknown-unknown/release/mte_slam_web.wasm"

cd www
[ -d node_modules ] && [ node_modules/.package-lock.json -nt package-lock.json ] || npm ci --no-fund --no-audit
wasm=pkg/mte_slam_web_bg.wasm
# Functions by how often they are called: shorter numbers in calls take 1 % off.
node_modules/.bin/wasm-opt -O3 --reorder-functions --enable-simd --enable-bulk-memory --enable-nontrapping-float-to-int \
    --enable-sign-ext --enable-mutable-globals --enable-reference-types --enable-multivalue \
    -o "$wasm.tmp" "$wasm"
mv "$wasm.tmp" "$wasm"

bytes=$(wc -c <"$wasm")
zipped=$(gzip -9 -c "$wasm" | wc -c)
say "wasm: $bytes bytes (limit $limit_bytes), $zipped after gzip (limit $limit_gzip_bytes)"
if [ "$bytes" -gt "$limit_bytes" ] || [ "$zipped" -gt "$limit_gzip_bytes" ]; then
    say "over the size budget" >&2
    exit 1
fi
npm run --silent build
say "www/dist is ready"
