#!/usr/bin/env bash
# packaging/deb.sh: builds the Debian packages from a copy of the sources into out/deb, without a network but for what npm has to fetch before,
# and has lintian look at them.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$PWD/out/deb
source=$out/source
plotly=node_modules/plotly.js-cartesian-dist-min

if [ ! -e "$plotly" ]; then
  PATH=$PATH:$PWD/build-node/bin npm ci --ignore-scripts --no-audit --no-fund
fi
rm -rf "$out"
mkdir -p "$source/node_modules"
tar --create --exclude-vcs --exclude='./build*' --exclude=./out --exclude=./node_modules --exclude=__pycache__ . | tar --extract --directory "$source"
cp -a "$plotly" "$source/node_modules/"
(
  cd "$source"
  dpkg-buildpackage --build=binary --unsigned-source --unsigned-changes
)
rm -rf "$source"
ls -l "$out"
lintian --info --display-info --pedantic --show-overrides --fail-on error,warning "$out"/*.changes
