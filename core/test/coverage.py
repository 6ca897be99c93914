#!/usr/bin/env python3
"""Lines and branches of core that its own tests take: coverage.py BUILD, of a build with TRIHEDRON_COVERAGE after its tests.

A branch is one outcome, true or false, of one condition. The instances of a template count as one: a line or branch is taken where it is in
any of them. What is constant to the compiler has no outcome, and the inside of the assertion, the one macro, is not looked into. Prints both
shares and the branches that are missed. Exit status 1 where a share is below LEAST_PERCENT.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LEAST_PERCENT = 95
PROGRAMS = ["core_test", "core_application_test", "core_no_heap_test"]
FILE = re.compile(r"^(/\S+):$")
LINE = re.compile(r"^ *(\d+)\| *([\d.]+\w?)\|(.*)$")
BRANCH = re.compile(r"^ *(?:\|\s*)*Branch \((\d+):(\d+)\): \[True: (\S+), False: (\S+)\]$")


def shown(build):
    """What llvm-cov tells of the sources, with a count for each line and each outcome in each instance."""
    merged = build / "coverage" / "core.profdata"
    subprocess.run(["llvm-profdata-16", "merge", "-o", merged, *sorted((build / "coverage").glob("*.profraw"))], check=True)
    objects = [f"--object={build / program}" for program in PROGRAMS]
    return subprocess.run(
        ["llvm-cov-16", "show", f"--instr-profile={merged}", *objects, "--show-branches=count", "--show-instantiations=false",
         build / "core" / "libtrihedron_core.a", ROOT / "core" / "src", ROOT / "core" / "include"],
        check=True, capture_output=True, text=True).stdout


def counted(text):
    """Whether taken, of each line (file, number) and of each outcome (file, line, column, outcome)."""
    lines, branches, file = {}, {}, None
    for row in text.splitlines():
        if match := FILE.match(row):
            file = str(pathlib.Path(match[1]).relative_to(ROOT))
        elif match := LINE.match(row):
            lines[file, int(match[1])] = match[2] != "0"
        elif match := BRANCH.match(row):
            for outcome, count in (("true", match[3]), ("false", match[4])):
                key = file, int(match[1]), int(match[2]), outcome
                branches[key] = branches.get(key, False) or count != "0"
    return lines, branches


def percent(taken):
    return 100 * sum(taken.values()) / len(taken)


def main():
    lines, branches = counted(shown(pathlib.Path(sys.argv[1]).resolve()))
    for file, line, column, outcome in sorted(key for key, taken in branches.items() if not taken):
        text = (ROOT / file).read_text().splitlines()[line - 1]
        print(f"{file}:{line}:{column}: never {outcome}: {text[column - 1:]}")
    print(f"lines: {percent(lines):.1f} % of {len(lines)}; branches: {percent(branches):.1f} % of {len(branches)}")
    return 0 if min(percent(lines), percent(branches)) >= LEAST_PERCENT else 1


if __name__ == "__main__":
    sys.exit(main())
