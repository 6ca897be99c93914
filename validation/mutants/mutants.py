#!/usr/bin/python3
"""Whether core's tests notice wrong formulas: mutants.py BUILD OUTCOMES [--document DOCUMENT] [--only PATTERN] [--count N] [--jobs N].

All edits of edits.toml are compiled into one build of core and its tests: each function that has some stands there once for each of them, and
the number in the variable TRIHEDRON_MUTANT says which one runs. An edit outside of functions has a build of its own. Then the tests run
with each edit until one fails: first the one that failed with it in an earlier run, then the quick ones. Outcomes go into the file OUTCOMES
one by one, so that a run goes on where it was interrupted; they hold for the sources they were found with. Exit status 0: all edits are caught but those that need not be.
"""
import argparse
import concurrent.futures
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COPIED = ("core", "cmake")
PROGRAMS = ("core_test", "core_application_test", "core_no_heap_test")
BUILD_TIMEOUT_S = 3600
QUICK_S = 0.2  # tests that take less run together in one process
# Times of tests without an edit; with one they may take longer, and one that hangs is caught.
LONGEST_OF_USUAL, LONGEST_S = 5, 20

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
    """One line of JSON for each edit; of those of other sources only the test that failed is remembered."""

    def __init__(self, file, sources):
        self.file, self.sources, self.found, self.failed_before = file, sources, {}, {}
        if file.exists():
            for line in file.read_text().splitlines():
                its = json.loads(line)
                self.failed_before[its["key"]] = its["by"].split(",")[0]
                if its["sources"] == sources:
                    self.found[its["key"]] = its

    def add(self, edit, outcome, by):
        its = {"key": edit.key(), "sources": self.sources, "file": edit.file, "wrong": edit.wrong, "outcome": outcome, "by": by}
        self.found[edit.key()] = its
        with open(self.file, "a") as file:
            file.write(json.dumps(its, ensure_ascii=False) + "\n")


# ---- Which function an edit is in

# What has braces of its own and may contain functions.
SCOPE = re.compile(r"^(template\s*<.*?>\s*)*(inline\s+)?(namespace|class|struct|union|extern \"C\")\b", re.DOTALL)


def without_comments_and_texts(text):
    """Of the same length, with blanks in their place."""
    blank = lambda match: re.sub(r"[^\n]", " ", match[0])
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"(?!\s*\{)|(?<![0-9])\'(?:\\.|[^\'\\])\'', blank, text, flags=re.DOTALL)


def bodies(text):
    """Where the bodies of functions are, from the opening to the closing brace."""
    code = re.sub(r"^\s*#[^\n]*", lambda match: " " * len(match[0]), without_comments_and_texts(text), flags=re.MULTILINE)
    found, scopes, head, function_at, depth = [], [], 0, None, 0
    for at, character in enumerate(code):
        if function_at is not None:
            depth += {"{": 1, "}": -1}.get(character, 0)
            if depth == 0:
                found.append((function_at, at))
                function_at, head = None, at + 1
        elif character == "{":
            before = re.sub(r"^(public|private|protected):", "", code[head:at].strip()).strip()
            if SCOPE.match(before) and not before.endswith(")"):
                scopes.append(at)
                head = at + 1
            elif ")" in before and not before.startswith("enum") and not re.search(r"=\s*$|\w$(?<!const)(?<!noexcept)(?<!override)", re.sub(r"->.*$", "", before, flags=re.DOTALL).strip()):
                function_at, depth = at, 1
            else:
                scopes.append(at)  # an enumeration, or the value of a variable
                head = at + 1
        elif character == "}":
            scopes.pop()
            head = at + 1
        elif character == ";":
            head = at + 1
    return found


def with_all(text, numbered):
    """The text of a file with the edits of its functions, each run where its number is chosen. And the numbers of edits that are in none."""
    by_body, outside = {}, []
    places = bodies(text)
    for number, edit in numbered:
        edit.applied(text)
        begin = text.index(edit.old)
        body = next(((first, last) for first, last in places if first < begin and begin + len(edit.old) <= last), None)
        if body is None:
            outside.append(number)
        else:
            by_body.setdefault(body, []).append((number, edit))
    for (first, last), its in sorted(by_body.items(), reverse=True):
        body = text[first:last + 1]
        edited = "".join(f"if (trihedron_is_mutant({number})) {edit.applied(body)} else " for number, edit in its)
        text = f"{text[:first]}{{ {edited}{body} }}{text[last + 1:]}"
    return text, outside


# ---- Building and trying

class Bench:
    """A copy of core, its build and its tests. `edits`: those that are compiled in, by their numbers."""

    def __init__(self, build, jobs):
        self.copy, self.build, self.jobs = build / "copy", build / "build", str(jobs)

    def prepare(self, numbered):
        """Copies the sources with these edits; the numbers of those that are in no function. Keeps the times of files that stay the same."""
        outside = []
        for folder in COPIED:
            for source in sorted(its for its in (ROOT / folder).rglob("*") if its.is_file() and "__pycache__" not in its.parts):
                name = str(source.relative_to(ROOT))
                content = source.read_bytes()
                here = [(number, edit) for number, edit in numbered if edit.file == name]
                if here:
                    text, its = with_all(content.decode(), here)
                    content = text.encode()
                    outside += its
                put_if_changed(self.copy / name, content, source)
        return outside

    def edit_alone(self, edit):
        file = self.copy / edit.file
        file.write_text(edit.applied(file.read_text()))

    def built(self):
        """Nothing, or what the compiler says."""
        for command in (("cmake", "-S", HERE, "-B", self.build, "-G", "Ninja", f"-DCOPY={self.copy}"),
                        ("cmake", "--build", self.build, "--parallel", self.jobs, "--target", *PROGRAMS)):
            result = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=BUILD_TIMEOUT_S)
            if result.returncode != 0:
                return result.stdout + result.stderr
        return None

    def run(self, program, tests, number, limit_s):
        """The name of a test that fails, or nothing. A program that ends otherwise, or not at all, has failed too."""
        command = [self.directory(program), f"--gtest_filter={':'.join(tests)}", "--gtest_fail_fast"]
        try:
            result = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=limit_s,
                                    env=os.environ | {"TRIHEDRON_MUTANT": str(number)})
        except subprocess.TimeoutExpired:
            return f"{program}, which does not end"
        if result.returncode == 0:
            return None
        failed = re.findall(r"^\[  FAILED  \] (\S+?)(?:,| \()", result.stdout, re.MULTILINE)
        started = re.findall(r"^\[ RUN      \] (\S+)", result.stdout, re.MULTILINE)
        return failed[0] if failed else f"{started[-1]}, which crashes" if started else f"{program}, which crashes"

    def directory(self, program):
        return next(its for its in self.build.rglob(program) if its.is_file())

    def measure(self, sources):
        """Runs all tests without an edit, and plans by their times: (program, tests, longest time) in the order in which they are run. The
        plan for these sources is kept beside the build."""
        kept = self.build.parent / f"plan-{sources}.json"
        if kept.exists():
            self.plan = json.loads(kept.read_text())
            return
        quick, slow = [], []
        for program in PROGRAMS:
            with tempfile.TemporaryDirectory() as folder:
                report = pathlib.Path(folder) / "report.json"
                result = subprocess.run([self.directory(program), f"--gtest_output=json:{report}"], capture_output=True, text=True)
                if result.returncode != 0:
                    sys.exit(f"mutants: {program} fails without any edit\n{result.stdout[-2000:]}")
                suites = json.loads(report.read_text())["testsuites"]
            times = {f"{suite['name']}.{test['name']}": float(test["time"].rstrip("s")) for suite in suites for test in suite["testsuite"]}
            some = [name for name, time_s in times.items() if time_s < QUICK_S]
            quick.append((sum(times[name] for name in some), program, some))
            slow += [(time_s, program, [name]) for name, time_s in times.items() if time_s >= QUICK_S]
        self.plan = [(program, tests, LONGEST_OF_USUAL * time_s + LONGEST_S)
                     for time_s, program, tests in sorted(quick) + sorted(slow) if tests]
        kept.write_text(json.dumps(self.plan))

    def first_failure(self, number, likely):
        """The name of a test that fails with this edit; nothing where all pass. `likely`: of a test that is run first."""
        first = [(program, [likely], limit_s) for program, tests, limit_s in self.plan if likely in tests]
        for program, tests, limit_s in first + self.plan:
            if failure := self.run(program, tests, number, limit_s):
                return failure
        return None


def put_if_changed(target, content, source):
    if not target.exists() or target.read_bytes() != content:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
        shutil.copymode(source, target)


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


def table(all_edits, outcomes):
    """Lines of the document: by file, and each that is not caught."""
    lines = ["| file | edits | caught | need not be |", "|---|---:|---:|---:|"]
    found = [(edit, outcomes.found.get(edit.key(), {}).get("outcome")) for edit in all_edits]
    for file in dict.fromkeys(edit.file for edit in all_edits):
        here = [(edit, outcome) for edit, outcome in found if edit.file == file]
        caught = sum(outcome == CAUGHT for _, outcome in here)
        lines.append(f"| `{file}` | {len(here)} | {caught} | {sum(outcome == SURVIVED and bool(edit.harmless) for edit, outcome in here)} |")
    caught = sum(outcome == CAUGHT for _, outcome in found)
    harmless = [edit for edit, outcome in found if outcome == SURVIVED and edit.harmless]
    lines += [f"| together | {len(found)} | {caught} | {len(harmless)} |", "", "Not caught, and why that is right:", ""]
    return lines + [f"- `{edit.file}`: {edit.wrong}: {edit.harmless}." for edit in harmless]


def place(document, lines):
    text = document.read_text()
    pattern = re.compile(r"(<!-- mutants -->\n).*?(<!-- end -->)", re.DOTALL)
    assert pattern.search(text), f"{document} has no place for the table"
    document.write_text(pattern.sub(lambda match: match[1] + "\n".join(lines) + "\n" + match[2], text))


def try_all(left, build, jobs, outcomes):
    """`left`: numbers and edits."""
    def note(edit, outcome, by):
        outcomes.add(edit, outcome, by)
        print(f"{outcome:18} {edit.file}: {edit.wrong}" + (f" ({by})" if by else ""), flush=True)

    def try_one(bench, number, edit):
        failure = bench.first_failure(number, outcomes.failed_before.get(edit.key()))
        note(edit, *((CAUGHT, failure) if failure else (SURVIVED, "")))

    bench = Bench(build / "all", jobs)
    outside = bench.prepare(list(enumerate(edits(), 1)))
    if output := bench.built():
        sys.exit(f"mutants: core does not build with all edits\n{output[-4000:]}")
    bench.measure(outcomes.sources)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for _ in pool.map(lambda its: try_one(bench, *its), [its for its in left if its[0] not in outside]):
            pass
    alone = Bench(build / "alone", jobs)
    alone.plan = bench.plan
    for number, edit in left:
        if number in outside:
            alone.prepare([])
            alone.edit_alone(edit)
            if output := alone.built():
                note(edit, INVALID, next((line for line in output.splitlines() if "error" in line), output[-200:]))
            else:
                try_one(alone, number, edit)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("outcomes", type=pathlib.Path)
    parser.add_argument("--document", type=pathlib.Path, help="whose table is written once all edits have been tried")
    parser.add_argument("--only", default="", help="edits whose file or text matches")
    parser.add_argument("--count", type=int, default=None, help="at most so many, evenly over those that are left")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    arguments.outcomes.parent.mkdir(parents=True, exist_ok=True)
    all_edits = edits()
    outcomes = Outcomes(arguments.outcomes, digest())
    left = [(number, edit) for number, edit in enumerate(all_edits, 1)
            if edit.key() not in outcomes.found and re.search(arguments.only, f"{edit.file} {edit.wrong}")]
    if arguments.count is not None and arguments.count < len(left):
        left = [left[i * len(left) // arguments.count] for i in range(arguments.count)]
    if left:
        try_all(left, arguments.build.resolve(), arguments.jobs, outcomes)
    lines, done = report(all_edits, outcomes)
    print("\n".join(lines))
    if done and arguments.document:
        place(arguments.document, table(all_edits, outcomes))
    return 0 if done else 1


if __name__ == "__main__":
    sys.exit(main())
