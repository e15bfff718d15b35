#!/bin/sh
# Makes a compiler available that builds for wasm32-unknown-unknown and thumbv7em-none-eabi, and
# prints the shell commands that select it. Progress goes to standard error. Use as
#     setup=$(./scripts/wasm-toolchain.sh) && eval "$setup"
#
# rustup adds both targets where it can (nothing is printed then: the default compiler serves).
# Where it cannot, Debian and Ubuntu have a recent compiler and the source of the standard library
# as packages; they are unpacked, not installed, into a cache folder, and the standard library is
# built once.
#
# MTE_SLAM_CROSS=rustup|debian|auto chooses the way (default auto).
# Exit status: 0 ready, 3 not possible on this machine, anything else an error.
set -eu

targets="wasm32-unknown-unknown thumbv7em-none-eabi"
way=${MTE_SLAM_CROSS:-auto}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/mte-slam/cross-rustc
here=$(cd "$(dirname "$0")/.." && pwd)

say() { echo "wasm-toolchain: $*" >&2; }

have_targets() {
    for target in $targets; do
        # The folder's name is printed whether the target is there or not, so look inside.
        folder=$(rustc --print target-libdir --target "$target" 2>/dev/null) || return 1
        ls "$folder"/libcore-*.rlib >/dev/null 2>&1 || return 1
    done
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        say "'$*' needs root, and there is no sudo"
        return 1
    fi
}

by_rustup() {
    have_targets && return 0
    command -v rustup >/dev/null || return 1
    say "adding $targets by rustup"
    # A network that swallows packets must not hold up the fallback.
    limit=
    if command -v timeout >/dev/null; then limit="timeout 180"; fi
    # shellcheck disable=SC2086  # both are lists of words
    (cd "$here" && $limit rustup target add $targets) >&2 || return 1
    have_targets
}

# Sets `root` to the folder of a finished unpacked toolchain, if there is one.
find_unpacked() {
    root=
    for folder in "$cache"/*; do
        if [ -f "$folder/complete" ]; then root=$folder; fi
    done
    [ -n "$root" ]
}

# The commands that select the toolchain unpacked in $1.
selection() {
    library=$(dirname "$(find "$1/usr/lib" -name 'librustc_driver-*.so' | head -n 1)")
    host=$(rustc -vV | sed -n 's/^host: //p')
    linker=$(rustc --print sysroot)/lib/rustlib/$host/bin/rust-lld
    echo "export RUSTC='$1/usr/bin/rustc'"
    echo "export LD_LIBRARY_PATH='$library:$1/usr/lib'\${LD_LIBRARY_PATH:+:\$LD_LIBRARY_PATH}"
    echo "export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER='$linker'"
    # Two compilers in one folder would rebuild each other's artefacts.
    echo "export CARGO_TARGET_DIR=\"\${CARGO_TARGET_DIR:-$here/target}/cross\""
}

# Builds the standard library of target $2 with the toolchain in $1 and puts it into its sysroot;
# $3 are the crates, $4 is a scratch folder.
build_std() {
    mkdir -p "$4/src"
    printf '[package]\nname = "stub"\nversion = "0.0.0"\nedition = "2021"\n[workspace]\n' >"$4/Cargo.toml"
    echo '#![no_std]' >"$4/src/lib.rs"
    (
        eval "$(selection "$1")"
        export RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR="$4/target"
        cd "$4"
        cargo build --quiet --release --target "$2" "-Zbuild-std=$3" >&2
    ) || return 1
    mkdir -p "$1/usr/lib/rustlib/$2/lib"
    for library in "$4/target/$2/release/deps"/*.rlib; do
        case $library in */libstub-*) ;; *) cp "$library" "$1/usr/lib/rustlib/$2/lib/" ;; esac
    done
}

unpack() {
    command -v apt-get >/dev/null && command -v dpkg >/dev/null || return 3
    say "unpacking the distribution's compiler into $cache (once, about a minute)"
    as_root apt-get -qq update >&2 || say "apt-get update failed; trying with the lists at hand"
    std=$(apt-cache depends libstd-rust-web-dev 2>/dev/null |
        sed -n 's/.*Depends: \(libstd-rust-web-[0-9.]*\)$/\1/p' | head -n 1)
    if [ -z "$std" ]; then
        say "this distribution has no libstd-rust-web package"
        return 3
    fi
    llvm=$(apt-cache depends "$std" | sed -n 's/.*Depends: \(libllvm[0-9]*\)$/\1/p' | head -n 1)
    if [ -n "$llvm" ] && ! dpkg -s "$llvm" >/dev/null 2>&1; then
        as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y "$llvm" >&2 || return 1
    fi
    mkdir -p "$cache"
    # Not a name that `find_unpacked` would look at, and renamed only when complete.
    scratch=$(mktemp -d "$cache/.unpacking.XXXXXX")
    trap 'rm -rf "$scratch"' EXIT
    trap 'exit 130' INT TERM
    mkdir "$scratch/root" "$scratch/deb"
    (cd "$scratch/deb" && apt-get -qq download rustc-web libstd-rust-web-dev "$std" rust-web-src) >&2 ||
        return 1
    for package in "$scratch"/deb/*.deb; do dpkg -x "$package" "$scratch/root" || return 1; done
    build_std "$scratch/root" wasm32-unknown-unknown std,panic_abort "$scratch/wasm" || return 1
    build_std "$scratch/root" thumbv7em-none-eabi core,alloc "$scratch/thumb" || return 1
    version=$(apt-cache policy rustc-web | sed -n 's/.*Candidate: //p')
    touch "$scratch/root/complete"
    [ -f "$cache/$version/complete" ] || mv "$scratch/root" "$cache/$version"
    say "ready: $cache/$version"
}

by_debian() {
    find_unpacked || unpack || return $?
    find_unpacked || return 1
    selection "$root"
}

case $way in
    rustup) by_rustup || exit 3 ;;
    debian) by_debian ;;
    auto) by_rustup || by_debian ;;
    *)
        say "MTE_SLAM_CROSS is '$way'; expected rustup, debian or auto"
        exit 2
        ;;
esac
