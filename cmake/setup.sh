#!/usr/bin/env bash
# cmake/setup.sh [GROUP…]: installs what is missing of these groups on Debian 12, of program, tests and lint where none is named; does
# nothing, quickly, when nothing is.
set -euo pipefail

program=(
  g++ cmake ninja-build pkg-config
  libeigen3-dev libhdf5-dev libcli11-dev libtomlplusplus-dev libfmt-dev nlohmann-json3-dev libnetcdf-dev libfast-float-dev libsqlitecpp-dev
  libtbb-dev libboost-dev liberfa-dev nodejs npm ca-certificates
)
# Tests, their coverage, benches, validation.
tests=(
  libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev
  chromium-headless-shell
  gcovr python3 python3-pytest python3-xarray python3-h5netcdf
)
docs=(doxygen)
lint=(git ca-certificates python3 python3-venv)

packages=()
for name in ${*:-program tests lint}; do
  case $name in
    program|tests|lint|docs) declare -n members=$name && packages+=("${members[@]}") ;;
    *) echo "setup: no group \"$name\"; there are program, tests, lint, docs" >&2; exit 2 ;;
  esac
done

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
"${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
  "${missing[@]}" >/dev/null
