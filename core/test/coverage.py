#!/usr/bin/env python3
"""Lines and branches of core that its own tests take: coverage.py BUILD, of a build with TRIHEDRON_COVERAGE after its tests.

A branch is one outcome, true or false, of one condition. The instances of a template count as one: a line or branch is taken where it is in
any of them. What is constant to the compiler has no outcome, and the inside of the assertion, the one macro, is not looked into. Prints both
shares and the branches that are missed, each with its reason of missed_branches.toml. Exit status 1 where a share is below LEAST_PERCENT or a
branch is missed without a reason.
"""
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
REASONS = pathlib.Path(__file__).with_name("missed_branches.toml")
LEAST_PERCENT = 95
PROGRAMS = ["core_test", "core_application_test", "core_no_heap_test"]
FILE = re.compile(r"^(/\S+):$")
LINE = re.compile(r"^ *(\d+)\| *([\d.]+\w?)\|(.*)$")
BRANCH = re.compile(r"^ *(?:\|\s*)*Branch \((\d+):(\d+)\): \[True: (\S+), False: (\S+)\]$")


def shown(build):
    """What llvm-cov tells of the sources, with a count for each line and each outcome in each instance."""
    merged = build / "coverage" / "core.profdata"
    subprocess.run(["llvm-profdata-16", "merge", "-o", merged, *sorted((build / "coverage").glob("*.profraw"))], check=True)
    # Of core its object files, for what no test program links; from the archive llvm-cov reads them only where they happen to be aligned.
    of_core = sorted((build / "core" / "CMakeFiles" / "trihedron_core.dir").rglob("*.o"))
    first, *others = [*(build / program for program in PROGRAMS), *of_core]
    return subprocess.run(
        ["llvm-cov-16", "show", f"--instr-profile={merged}", *(f"--object={other}" for other in others), "--show-branches=count",
         "--show-instantiations=false", first, ROOT / "core" / "src", ROOT / "core" / "include"],
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


def condition(row, column):
    """The text of a line from the word on that stands at this column, counted from 1."""
    return re.search(r"\w*$", row[:column - 1])[0] + row[column - 1:]


def reasons(text):
    """Why an outcome is missed, of each (file, outcome, how the condition begins)."""
    return {(file, outcome, begins): why for file, table in tomllib.loads(text).items() for outcome, begins, why in table["missed"]}


def reason_of(missed, known):
    """The (file, outcome, beginning) in `known` that is of the missed (file, outcome, condition), or None; the longest, if several are."""
    file, outcome, text = missed
    return max((its for its in known if its[:2] == (file, outcome) and text.startswith(its[2])), key=lambda its: len(its[2]), default=None)


def print_missed(missed, known):
    """Prints each missed outcome, {(file, line, column, outcome): condition}, with its reason; whether all have one."""
    found = {key: reason_of((key[0], key[3], text), known) for key, text in missed.items()}
    for key, text in sorted(missed.items()):
        print(f"{key[0]}:{key[1]}:{key[2]}: never {key[3]}: {text}\n    {known.get(found[key], 'without a reason')}")
    for file, outcome, begins in sorted(set(known) - set(found.values())):
        print(f"{file}: no longer missed: {outcome}: {begins}")
    untested = [its for its in found.values() if its and known[its].startswith("No test yet:")]
    without = [key for key, its in found.items() if its is None]
    print(f"missed: {len(missed)}; of these without a test yet: {len(untested)}; without a reason: {len(without)}")
    return not without


def main():
    lines, branches = counted(shown(pathlib.Path(sys.argv[1]).resolve()))
    keys = [key for key, taken in branches.items() if not taken]
    missed = {key: condition((ROOT / key[0]).read_text().splitlines()[key[1] - 1], key[2]) for key in keys}
    all_have_reasons = print_missed(missed, reasons(REASONS.read_text()))
    print(f"lines: {percent(lines):.1f} % of {len(lines)}; branches: {percent(branches):.1f} % of {len(branches)}")
    return 0 if all_have_reasons and min(percent(lines), percent(branches)) >= LEAST_PERCENT else 1


if __name__ == "__main__":
    sys.exit(main())
