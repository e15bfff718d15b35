#!/bin/sh
# Builds the browser's WebAssembly module, with its JavaScript and types, into a folder: by wasm-pack
# where it is on the path, else by Cargo and scripts/bindgen. Both give the same bytes.
#
#   scripts/web-module.sh FOLDER [auto|wasm-pack|cargo]
#
# MTE_SLAM_TOOLS   see scripts/bindgen.sh
set -eu
cd "$(dirname "$0")/.."
folder=${1:?"usage: scripts/web-module.sh FOLDER [auto|wasm-pack|cargo]"}
way=${2:-auto}
case $folder in /*) ;; *) folder=$PWD/$folder ;; esac
if [ "$way" = auto ]; then
    if command -v wasm-pack >/dev/null; then way=wasm-pack; else way=cargo; fi
fi

# Before another compiler may be chosen below: wasm-bindgen runs on this machine.
case $way in
    # It would look for wasm-bindgen's command, and download or compile it where there is none.
    wasm-pack) bindgen=$(./scripts/bindgen.sh --if-there) ;;
    cargo) bindgen=$(./scripts/bindgen.sh) ;;
    *)
        echo "web-module: found way '$way', expected auto, wasm-pack or cargo" >&2
        exit 2
        ;;
esac
setup=$(sh ./scripts/wasm-toolchain.sh)
eval "$setup"
# Not the native programs' folder: web/.cargo/config.toml has flags of its own.
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}/web"

rm -rf "$folder"
if [ "$way" = wasm-pack ]; then
    if [ -n "$bindgen" ]; then PATH="$(dirname "$bindgen"):$PATH"; fi
    wasm-pack build web --target web --no-pack --out-dir "$folder" -- --locked
    # It would keep the module out of npm's package.
    rm -f "$folder/.gitignore"
else
    (cd web && cargo build --lib --release --locked --target wasm32-unknown-unknown)
    "$bindgen" --target web --out-dir "$folder" \
        "$CARGO_TARGET_DIR/wasm32-unknown-unknown/release/mte_slam_web.wasm"
fi
