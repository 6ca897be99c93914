#!/usr/bin/env bash
# packaging/root.sh ROOT [PACKAGE…]: a fresh root of Debian 12 in ROOT, with the packages of out/deb that are named, what they depend on, and
# other packages of Debian.
set -euo pipefail
root=$1
shift
packages=("$@")
debs=$(cd "$(dirname "$0")/.." && pwd)/out/deb

arguments=()
for i in "${!packages[@]}"; do
  deb=$(compgen -G "$debs/${packages[i]}_*.deb" || true)
  if [ -n "$deb" ]; then
    # apt takes it by its path within the root.
    arguments+=(--customize-hook="copy-in $deb /var/tmp")
    packages[i]=/var/tmp/$(basename "$deb")
  fi
done
rm -rf "$root"
mmdebstrap --quiet --variant=apt "${arguments[@]}" \
  --customize-hook="chroot \"\$1\" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --quiet=2 --no-install-recommends ${packages[*]} > /dev/null" \
  --customize-hook='rm -f "$1"/var/tmp/*.deb' bookworm "$root"
