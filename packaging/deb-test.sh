#!/usr/bin/env bash
# packaging/deb-test.sh: installs the packages of out/deb into a fresh root of Debian each, and runs the tests of debian/tests there.
set -euo pipefail
cd "$(dirname "$0")/.."
root=out/deb/root

# Stanzas of debian/tests/control: one test each, with what it depends on.
while read -r test depends; do
  echo "$test: a fresh root with $depends"
  # shellcheck disable=SC2086
  packaging/root.sh "$root" $depends
  mkdir "$root/tests"
  cp "debian/tests/$test" "$root/tests/"
  # By it a program finds what is installed beside it.
  mount --types proc proc "$root/proc"
  trap 'umount "$root/proc"' EXIT
  chroot "$root" "/tests/$test" < /dev/null
  umount "$root/proc"
  trap - EXIT
  rm -rf "$root"
  echo "$test: passed"
done < <(sed -n 's/^Tests: *//p; s/^Depends: *//p' debian/tests/control | tr -d , | paste -d ' ' - -)
