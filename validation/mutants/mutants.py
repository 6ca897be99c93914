#!/usr/bin/python3
"""Whether core's tests notice wrong formulas: mutants.py BUILD OUTCOMES [--only PATTERN] [--count N] [--jobs N].

Makes each edit of edits.toml in a copy of the sources, builds core and its tests, and runs these until one fails. Outcomes go into the
file OUTCOMES one by one, so that a run goes on where it was interrupted; they hold for the sources they were found with. Exit status 0:
all edits are caught but those that need not be.
"""
import argparse
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COPIED = ("core", "cmake")
BUILD_TIMEOUT_S = 3600
TESTS_TIMEOUT_S = 1800

CAUGHT, SURVIVED, INVALID = "caught", "survived", "does not compile"


@dataclasses.dataclass(frozen=True)
class Edit:
    file: str
    old: str
    new: str
    wrong: str
    harmless: str = ""  # why it need not be caught

    def key(self):
        return hashlib.sha256("\0".join((self.file, self.old, self.new)).encode()).hexdigest()[:16]

    def applied(self, text):
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file} has {text.count(self.old)} times: {self.old}")
        return text.replace(self.old, self.new)


def edits(table=HERE / "edits.toml"):
    with open(table, "rb") as file:
        return [Edit(name, *edit) for name, its in tomllib.load(file).items() for edit in its["edits"]]


def digest(root=ROOT):
    """Of all sources that an outcome depends on."""
    total = hashlib.sha256()
    for folder in COPIED:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".cpp", ".hpp", ".txt", ".cmake"):
                total.update(str(file.relative_to(root)).encode() + b"\0" + file.read_bytes())
    return total.hexdigest()[:16]


class Outcomes:
    """One line of JSON for each edit; those of other sources are left out."""

    def __init__(self, file, sources):
        self.file, self.sources, self.found = file, sources, {}
        if file.exists():
            for line in file.read_text().splitlines():
                its = json.loads(line)
                if its["sources"] == sources:
                    self.found[its["key"]] = its

    def add(self, edit, outcome, by):
        its = {"key": edit.key(), "sources": self.sources, "file": edit.file, "wrong": edit.wrong, "outcome": outcome, "by": by}
        self.found[edit.key()] = its
        with open(self.file, "a") as file:
            file.write(json.dumps(its, ensure_ascii=False) + "\n")


class Bench:
    """A copy of core, its build and its tests."""

    def __init__(self, build, jobs):
        self.copy, self.build, self.jobs = build / "copy", build / "build", str(jobs)
        for folder in COPIED:
            shutil.copytree(ROOT / folder, self.copy / folder, dirs_exist_ok=True, copy_function=copy_if_changed)
        self.run("cmake", "-S", HERE, "-B", self.build, "-G", "Ninja", f"-DCOPY={self.copy}")

    @staticmethod
    def run(*command, timeout=BUILD_TIMEOUT_S):
        result = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout)
        return result.returncode == 0, result.stdout + result.stderr

    def builds(self):
        return self.run("cmake", "--build", self.build, "--parallel", self.jobs)

    def first_failure(self):
        """The name of a test that fails; nothing where all pass. Those that take long come last."""
        for label in ("-LE", "-L"):
            try:
                passed, output = self.run("ctest", "--test-dir", self.build, label, "long", "-E", "InstalledPackage", "--stop-on-failure",
                                          "--parallel", self.jobs, "--timeout", "120", timeout=TESTS_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                return "time limit of all tests"
            if not passed:
                names = re.findall(r"Test +#\d+: (\S+) .*\*\*\*", output)
                return names[0] if names else "a test program that ends at once"
        return None

    def outcome(self, edit):
        file = self.copy / edit.file
        before = file.read_text()
        try:
            file.write_text(edit.applied(before))
            built, output = self.builds()
            if not built:
                return INVALID, next((line for line in output.splitlines() if "error" in line), output[-200:])
            failure = self.first_failure()
            return (CAUGHT, failure) if failure else (SURVIVED, "")
        finally:
            file.write_text(before)


def copy_if_changed(source, target):
    """Keeps the time of what is the same, so that it is not compiled again."""
    if not os.path.exists(target) or pathlib.Path(source).read_bytes() != pathlib.Path(target).read_bytes():
        shutil.copy2(source, target)
        os.utime(target)


def report(all_edits, outcomes):
    """Lines for people, and whether nothing is left to do."""
    done = [(edit, outcomes.found[edit.key()]) for edit in all_edits if edit.key() in outcomes.found]
    caught = [edit for edit, its in done if its["outcome"] == CAUGHT]
    lines = [f"{len(all_edits)} edits, {len(done)} tried, {len(caught)} caught"]
    wrong = False
    for edit, its in done:
        where = f"{edit.file}: {edit.wrong}"
        if its["outcome"] == INVALID:
            lines.append(f"DOES NOT COMPILE  {where}: {its['by']}")
            wrong = True
        elif its["outcome"] == SURVIVED:
            lines.append(f"not caught, harmless  {where}: {edit.harmless}" if edit.harmless else f"NOT CAUGHT  {where}")
            wrong = wrong or not edit.harmless
        elif edit.harmless:
            lines.append(f"caught, though said to be harmless  {where}: by {its['by']}")
    return lines, not wrong and len(done) == len(all_edits)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("outcomes", type=pathlib.Path)
    parser.add_argument("--only", default="", help="edits whose file or text matches")
    parser.add_argument("--count", type=int, default=None, help="at most so many, evenly over those that are left")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    arguments.build.mkdir(parents=True, exist_ok=True)
    arguments.outcomes.parent.mkdir(parents=True, exist_ok=True)
    all_edits = edits()
    outcomes = Outcomes(arguments.outcomes, digest())
    left = [edit for edit in all_edits if edit.key() not in outcomes.found and re.search(arguments.only, f"{edit.file} {edit.wrong}")]
    if arguments.count is not None and arguments.count < len(left):
        left = [left[i * len(left) // arguments.count] for i in range(arguments.count)]
    if left:
        bench = Bench(arguments.build.resolve(), arguments.jobs)
        built, output = bench.builds()
        if not built:
            sys.exit(f"mutants: core does not build without any edit\n{output[-2000:]}")
        if failure := bench.first_failure():
            sys.exit(f"mutants: {failure} fails without any edit")
        for edit in left:
            outcome, by = bench.outcome(edit)
            outcomes.add(edit, outcome, by)
            print(f"{outcome:18} {edit.file}: {edit.wrong}" + (f" ({by})" if by else ""), flush=True)
    lines, done = report(all_edits, outcomes)
    print("\n".join(lines))
    return 0 if done else 1


if __name__ == "__main__":
    sys.exit(main())
