#!/usr/bin/env bash
# Installs what is missing on Debian 12; does nothing, quickly, when nothing is. With the argument `docs`: what `make docs` needs.
set -euo pipefail

packages=(
  build-essential cmake ninja-build git ca-certificates
  libeigen3-dev libhdf5-dev libcli11-dev libtomlplusplus-dev libfmt-dev nlohmann-json3-dev libnetcdf-dev libfast-float-dev libsqlitecpp-dev
  libtbb-dev libboost-dev libboost-math-dev liberfa-dev pkg-config nodejs npm
  libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev
  gcovr chromium-headless-shell
  python3 python3-venv python3-pytest python3-xarray python3-h5netcdf
)
if [ "${1:-}" = docs ]; then
  packages=(doxygen)
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
done
# A node or npm of other origin serves as well as Debian's.
for tool in nodejs:node npm:npm; do
  if command -v "${tool#*:}" >/dev/null; then
    missing=($(printf '%s\n' "${missing[@]}" | grep -vx "${tool%%:*}" || true))
  fi
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

sudo=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup: run as root, or install sudo; missing: ${missing[*]}" >&2; exit 1; }
  sudo=(sudo)
fi
echo "setup: installing ${missing[*]}"
"${sudo[@]}" apt-get update -qq
"${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
