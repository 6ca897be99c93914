#!/usr/bin/env bash
# cmake/setup.sh [GROUP…]: installs what is missing of these groups on Debian 12, of program, tests, sanitizers, flight, lint, mpi and python where none
# is named; does nothing, quickly, when nothing is.
set -euo pipefail
cd "$(dirname "$0")/.."

program=(
  clang-16 cmake ninja-build pkg-config
  libeigen3-dev libhdf5-dev libcli11-dev libtomlplusplus-dev libfmt-dev nlohmann-json3-dev libspdlog-dev libnetcdf-dev libfast-float-dev libsqlitecpp-dev
  libtbb-dev libboost-dev liberfa-dev libpugixml-dev ca-certificates
)
# Tests, benches, validation.
tests=(
  g++ libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev
  chromium-headless-shell
  doxygen valgrind python3 python3-pytest python3-xarray python3-h5netcdf python3-jsonschema
)
# The site of the documents; what it needs of PyPI is in docs/requirements.txt.
docs=(doxygen python3 python3-venv)
# Other software that reads what the program writes: Orekit runs on Java, the rest comes from PyPI.
interop=(default-jre-headless python3 python3-venv)
# The Python package; what it needs of PyPI is in python/requirements.txt.
python=(g++ python3 python3-dev python3-venv)
# Campaigns under mpirun.
mpi=(openmpi-bin libopenmpi-dev)
# Filters in Python, whose packages come from PyPI, and the batch with Ceres.
peers=(python3 python3-venv libceres-dev)
# ARM Cortex-M7 without an operating system, emulated: a short flight is among the tests.
flight=(gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib qemu-system-arm)
# The further targets of `make flight`.
targets=(g++-s390x-linux-gnu g++-riscv64-linux-gnu g++-multilib-sparc64-linux-gnu qemu-user)
# Program and tests under sanitizers, the coverage of core, libFuzzer.
sanitizers=(libclang-rt-16-dev lld-16 llvm-16)
# Debian packages and the root of an OCI image, and what tries them.
packaging=(g++ debhelper fakeroot lintian mmdebstrap buildah python3 python3-venv)
lint=(git ca-certificates cppcheck python3 python3-venv)

packages=()
for name in ${*:-program tests sanitizers flight lint mpi python}; do
  case $name in
    program|tests|sanitizers|flight|targets|lint|docs|interop|python|peers|mpi|packaging) declare -n members=$name && packages+=("${members[@]}") ;;
    *) echo "setup: no group \"$name\"; there are program, tests, sanitizers, flight, targets, lint, docs, interop, python, peers, mpi, packaging" >&2; exit 2 ;;
  esac
  if [ "$name" = program ]; then program_wanted=yes; fi
done

look_for_missing() {
  missing=()
  for package in "${packages[@]}"; do
    dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
  done
}

# Node and npm, which fetch what the report draws with and run its tests: those of the machine, else of PyPI. Debian's npm needs hundreds
# of packages, minutes of a first build.
needs_node() {
  [ -n "${program_wanted:-}" ] && ! { command -v node && command -v npm; } >/dev/null && ! [ -e build-node/installed ]
}
look_for_missing
if [ ${#missing[@]} -eq 0 ] && ! needs_node; then
  exit  # also while others are installed
fi
# One at a time, where several are asked for beside each other: apt-get does not wait.
exec 9<cmake/setup.sh
flock 9
look_for_missing
if needs_node; then
  dpkg-query -W -f '${db:Status-Status}' python3-venv 2>/dev/null | grep -qx installed || missing+=(python3-venv)
fi

if [ ${#missing[@]} -gt 0 ]; then
  sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "setup: run as root, or install sudo; missing: ${missing[*]}" >&2; exit 1; }
    sudo=(sudo)
  fi
  echo "setup: installing ${missing[*]}"
  "${sudo[@]}" apt-get update -qq
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    "${missing[@]}" >/dev/null
fi

if needs_node; then
  echo "setup: fetching node and npm into build-node"
  python3 -m venv build-node
  build-node/bin/pip install --quiet --disable-pip-version-check --requirement cmake/node-requirements.txt
  touch build-node/installed
fi
