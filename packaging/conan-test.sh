#!/usr/bin/env bash
# packaging/conan-test.sh: makes the Conan package of the flight library without any remote, with Eigen of the system and, for one on-board object,
# with a package of Eigen; another project uses each. All that Conan keeps is in build-conan.
set -euo pipefail
cd "$(dirname "$0")/.."
conan=build-conan/bin/conan
export CONAN_HOME=$PWD/build-conan/home

[ -e build-conan/bin/pip ] || python3 -m venv build-conan
build-conan/bin/pip install --quiet --disable-pip-version-check --requirement packaging/conan/requirements.txt
$conan profile detect --exist-ok > /dev/null 2>&1

create() {
  $conan create packaging/conan --no-remote --settings compiler.cppstd=20 --conf tools.cmake.cmake_layout:test_folder="$PWD/build-conan/test" "$@"
}
create --options '&:system_eigen=True'
$conan create packaging/conan/eigen --no-remote
create --options '&:on_board=pair'
echo 'conan-test: passed'
