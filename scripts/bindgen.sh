#!/bin/sh
# Prints the path of a `wasm-bindgen` of exactly the library's version, as its modules need: the one on
# the path, or scripts/bindgen, which is built once (40 crates; progress goes to standard error).
#
#   scripts/bindgen.sh [--if-there]   prints nothing, and builds nothing, where there is none yet
#
# MTE_SLAM_TOOLS   where it is kept (default: the user's cache folder, by version)
set -eu
cd "$(dirname "$0")/.."
tools=${MTE_SLAM_TOOLS:-${XDG_CACHE_HOME:-$HOME/.cache}/mte-slam/tools}

locked() { sed -n '/^name = "'"$1"'"$/{n;s/version = "\(.*\)"/\1/p;}' "$2"; }
version=$(locked wasm-bindgen Cargo.lock)
own=$(locked wasm-bindgen-cli-support scripts/bindgen/Cargo.lock)
if [ "$version" != "$own" ]; then
    echo "bindgen: scripts/bindgen has wasm-bindgen $own, Cargo.lock $version; change scripts/bindgen/Cargo.toml" >&2
    exit 1
fi

bindgen=$(command -v wasm-bindgen || true)
if [ -z "$bindgen" ] || [ "$("$bindgen" --version)" != "wasm-bindgen $version" ]; then
    # By its source, too: a change of ours must not find the program of before.
    key=$version-$(cat scripts/bindgen/src/main.rs scripts/bindgen/Cargo.lock | cksum | cut -d ' ' -f 1)
    bindgen=$tools/bindgen-$key/bin/wasm-bindgen
    if [ ! -x "$bindgen" ] && [ "${1:-}" = --if-there ]; then exit 0; fi
    if [ ! -x "$bindgen" ]; then
        echo "bindgen: building the part of wasm-bindgen $version that is needed, into $tools (once)" >&2
        CARGO_TARGET_DIR=$tools/build cargo install --locked --path scripts/bindgen --root "$tools/bindgen-$key" >&2
        rm -rf "$tools/build"
    fi
fi
echo "$bindgen"
