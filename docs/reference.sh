#!/usr/bin/env bash
# docs/reference.sh OUT: the reference of the libraries, by docs/Doxyfile, into OUT/cpp. Fails on each warning of Doxygen but those of members and
# constants that have no comment of their own, which it leaves in OUT/warnings.txt with all others.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p "$1/cpp"
# The file of tags says which page is of which header, for links from the other pages.
{ cat docs/Doxyfile; printf 'OUTPUT_DIRECTORY = "%s"\nGENERATE_TAGFILE = "%s/cpp/trihedron.tag"\nWARN_LOGFILE = "%s/warnings.txt"\n' "$1" "$1" "$1"; } | doxygen -
! grep -vE 'Member .* (of (struct|class)|\((variable|typedef)\) of namespace) .* is not documented' "$1/warnings.txt"
