#!/bin/sh
# Builds the page: the WebAssembly package into www/pkg, then www/dist, static files that work from
# any sub-path. Checks the size budget. Needs Rust with the wasm32 target and Node 20 or newer.
#
# With wasm-pack on the path, that builds the module (see scripts/web-module.sh).
set -eu
cd "$(dirname "$0")/.."
limit_bytes=2500000
limit_gzip_bytes=900000

say() { echo "build-web: $*"; }

./scripts/web-module.sh www/pkg

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
