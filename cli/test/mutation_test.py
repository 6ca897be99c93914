#!/usr/bin/env python3
"""The whole program on spoilt inputs: whatever a file holds, it ends soon, in bounded memory, with a status from 0 to 3 and at most one line
on stderr, changes nothing but its output, and writes that only when it has not refused.

    mutation_test.py PROGRAM [--seed S] [--inputs N] [--jobs J] [--only I] [--keep DIRECTORY]

Input I of seed S is always the same. A failure is printed with the command that repeats it. Standard library only.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time

import hdf5_checksums
import mutations
from program import DO_NOT_USE, INPUT_REFUSED, TOLD, TRUSTWORTHY

LIMIT_CPU_S = 10  # of all threads; several times what the longest takes
LIMIT_S = 90  # wall clock: who waits for nothing takes no processor time
LIMIT_BYTES = 400 << 20  # resident
ADDRESS_SPACE_BYTES = 8 << 30  # beyond it memory is refused: no machine is brought down by a failure
FILE_BYTES = 200 << 20
SHORT = '[scenario]\nseed = {seed}\nduration = "150s"\n[gyro]\nperiod = "1s"\n'
FOUR = SHORT + "".join(f"[[gyro.unit]]\nstart_direction_c = {direction}\n" for direction in
                       ([1, 0.1, 0], [0.1, 1, 0], [0, 0.1, 1], [0.6, 0.6, 0.5])) + """
[star_tracker]
dropout_probability = 0.05
[[star_tracker.further]]
mounting_rotation_vector = ["0deg", "60deg", "0deg"]
alignment_prior_sigma = "1arcmin"
"""


class Originals:
    """The files that are spoilt, made by the program itself."""

    def __init__(self, program, examples, directory):
        self.directory = directory
        self.program = program
        every_key = (examples / "paper.toml").read_text().replace('"9h"', '"150s"').replace('period = "125ms"', 'period = "1s"')
        every_key = re.sub(r"(?m)^# (harmonics|kappa|sun_exclusion|earth_exclusion|max_rate|mounting_rotation_vector)\b", r"\1", every_key)
        texts = {"short.toml": SHORT.format(seed=1), "second.toml": SHORT.format(seed=2), "four.toml": FOUR.format(seed=3),
                 "every.toml": every_key, "told.toml": TOLD}
        for name, text in texts.items():
            (directory / name).write_text(text)
        self.run("simulate", "short.toml", "-o", "pass")
        self.run("simulate", "short.toml", "-o", "pass.nc")
        self.run("simulate", "second.toml", "-o", "second")
        self.run("simulate", "four.toml", "-o", "four")
        self.run("simulate", "four.toml", "-o", "four.nc")
        self.run("calibrate", "pass", "-o", "out", "--config", "told.toml", "--catalogue", "catalogue.db")
        self.run("calibrate", "second", "-o", "out2", "--config", "told.toml", "--catalogue", "catalogue.db")
        self.run("navigate", "pass", "--online", "-o", "attitude.csv")
        for form in ("acm", "acm-xml"):
            self.run("export", "out/calibration.json", "--format", form, "-o", f"calibration.{form}", "--attitude", "attitude.csv")
        for form in ("aem", "aem-xml", "apm", "apm-xml"):
            self.run("export", "attitude.csv", "--format", form, "-o", f"attitude.{form}", "--pass", "pass", "--time-system", "UTC")
        self.run("export", "attitude.csv", "--format", "ck", "-o", "attitude.bc", "--pass", "pass")
        for name in ("pass", "four"):
            (directory / f"{name}_packets").mkdir()
            self.run("export", name, "--format", "packets", "-o", f"{name}_packets/telemetry.ccsds")
        self.run("replay", "pass", "--speed", "max", "--state", "replay.state")
        shutil.copytree(examples / "telemetry", directory / "telemetry")
        shutil.copy(directory / "out/calibration.json", directory)
        shutil.copy(directory / "out/effective-config.toml", directory / "config.toml")
        shutil.copytree(directory / "pass", directory / "known")
        shutil.copy(directory / "calibration.json", directory / "known/prior.json")
        toml = (directory / "known/pass.toml").read_text()
        (directory / "known/pass.toml").write_text('prior = "prior.json"\n' + toml)
        (directory / "recorded.toml").write_text(SHORT.format(seed=1) +
                                                 '[attitude]\nreference = "recorded"\nrecorded = "attitude.csv"\n')

        (directory / "orbit.oem").write_text(round_orbit())
        (directory / "orbit.toml").write_text(SHORT.format(seed=1) + '[orbit]\nephemeris = "orbit.oem"\n')

    def run(self, *arguments):
        done = subprocess.run([self.program, "--quiet", *arguments], cwd=self.directory, capture_output=True, text=True, timeout=60)
        if done.returncode not in (TRUSTWORTHY, DO_NOT_USE):
            raise SystemExit(f"cannot make the inputs: trihedron {' '.join(arguments)}: status {done.returncode}: {done.stderr}")


def round_orbit():
    """An OEM from five minutes before the epoch of a scenario on, for forty minutes."""
    lines = ["CCSDS_OEM_VERS = 2.0", "CREATION_DATE = 2026-01-02T03:04:05", "ORIGINATOR = TEST", "META_START", "OBJECT_NAME = TEST",
             "OBJECT_ID = 2026-001A", "CENTER_NAME = EARTH", "REF_FRAME = EME2000", "TIME_SYSTEM = TAI", "START_TIME = 2009-05-19T23:55:00",
             "STOP_TIME = 2009-05-20T00:35:00", "INTERPOLATION = LAGRANGE", "INTERPOLATION_DEGREE = 7", "META_STOP"]
    for minute in range(-5, 36):
        angle = 1.0780076e-3 * 60 * minute
        stamp = f"2009-05-20T00:{minute:02d}:00" if minute >= 0 else f"2009-05-19T23:{60 + minute:02d}:00"
        lines.append(f"{stamp} {7000 * math.cos(angle):.9f} {7000 * math.sin(angle):.9f} 0 {-7.546 * math.sin(angle):.12f} {7.546 * math.cos(angle):.12f} 0")
    return "\n".join(lines) + "\n"


# Mutations that know something of a binary format; each takes and returns bytes.


def spoil_text(rng, content):
    return mutations.spoilt(rng, content, mutations.TEXT)


def spoil_table(rng, content):
    return mutations.spoilt(rng, content, mutations.TABLE)


def spoil_bytes(rng, content):
    return mutations.spoilt(rng, content, mutations.BYTES)


def spoil_netcdf(rng, content):
    """Often in the metadata, which are a small part of the file; with checksums that fit, if the length is the same."""
    kind = rng.randrange(3)
    if kind == 0:
        return spoil_bytes(rng, content)
    begin, end = rng.choice(hdf5_checksums.blocks(content))
    part = content[begin:end]
    edit = rng.choice([mutations.flip_bits, mutations.set_bytes, mutations.overwrite_integer, mutations.zero_stretch])
    if kind == 1 and (found := list(mutations.NUMBER.finditer(part))):  # of the settings or the units
        match = rng.choice(found)
        value = rng.choice(mutations.EXTREMES).encode()[:len(match.group())].ljust(len(match.group()))
        part = part[:match.start()] + value + part[match.end():]
    else:
        part = edit(rng, part)[:end - begin]
    spoilt = content[:begin] + part + content[end:]
    return hdf5_checksums.repaired(content, spoilt) if len(spoilt) == len(content) else spoilt


STRANGE_SQL = [
    "DROP TABLE calibration; CREATE VIEW calibration AS WITH RECURSIVE r (id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM r) SELECT id, "
    "'' AS spacecraft, '' AS pass, '' AS start_up, 1 AS passes, '' AS json, '' AS epoch_tai, 0 AS t_s, '' AS estimator, "
    "'' AS drift_model FROM r",
    "CREATE TRIGGER thief AFTER INSERT ON calibration BEGIN DELETE FROM finding; END",
    "CREATE TRIGGER endless AFTER INSERT ON parameter BEGIN UPDATE parameter SET value = value + 1; END",
    "CREATE TABLE more (a, b)", "CREATE INDEX faster ON calibration (pass)", "DROP TABLE parameter", "DROP TABLE finding",
    "PRAGMA application_id = 0", "PRAGMA user_version = 0", "PRAGMA user_version = 2147483647", "PRAGMA journal_mode = WAL",
    "DELETE FROM calibration", "PRAGMA foreign_keys = OFF; DELETE FROM parameter", "PRAGMA encoding = 'UTF-16'; VACUUM",
    "UPDATE calibration SET json = ''", "UPDATE calibration SET json = hex(zeroblob(5000000))", "ANALYZE", "PRAGMA page_size = 512; VACUUM",
    "UPDATE calibration SET passes = 9223372036854775807", "UPDATE calibration SET epoch_tai = 'never', t_s = 1e308",
    "UPDATE calibration SET spacecraft = char(27) || '[31m'", "UPDATE calibration SET start_up = '<script>', pass = '../..'",
    "UPDATE calibration SET pass = CAST(x'ff00fe' AS TEXT)", "UPDATE parameter SET value = 9e999, sigma = -1",
]


def spoil_catalogue(rng, content):
    kind = rng.randrange(3)
    if kind == 0:
        return mutations.spoilt(rng, content, mutations.BYTES)
    with tempfile.TemporaryDirectory() as directory:
        file = pathlib.Path(directory, "c.db")
        file.write_bytes(content)
        database = sqlite3.connect(file)
        try:
            if kind == 1:
                database.executescript(rng.choice(STRANGE_SQL))
            else:
                row, text = rng.choice(database.execute("SELECT id, json FROM calibration").fetchall())
                spoilt = mutations.spoilt(rng, text.encode(), mutations.TEXT).decode(errors="replace")
                database.execute("UPDATE calibration SET json = ? WHERE id = ?", (spoilt, row))
        except sqlite3.Error:
            pass  # refused by SQLite itself: the file is what it is now
        database.commit()
        database.close()
        return file.read_bytes()


class Target(collections.namedtuple("Target", "file spoil needs commands changes", defaults=[()])):
    """`file` is spoilt; `needs` lie beside it. `{in}` and `{out}` in a command are directories. `changes` are inputs that the command is
    to change when it does not refuse."""


CALIBRATE = ("calibrate", "{in}/pass", "-o", "{out}", "--config", "{in}/told.toml")


def of_pass(name, file, spoil):
    path = f"{{in}}/{name}"
    calibrate = ("calibrate", path, "-o", "{out}", "--config", "{in}/told.toml")
    return Target(file, spoil, [name, "told.toml"], [
        ("inspect", path), ("--json", "inspect", path), calibrate, (*calibrate, "--estimator", "paper"), (*calibrate, "--estimator", "batch"),
        ("calibrate", path, "-o", "{out}"), ("navigate", path, "--online", "-o", "{out}/a.csv"), ("observe", path),
        ("replay", path, "--speed", "max", "-o", "{out}/a.csv", "--calibration", "{out}/c.json", "--state", "{out}/s")])


TARGETS = [
    of_pass("pass", "pass/gyro.csv", spoil_table),
    of_pass("pass", "pass/star_tracker.csv", spoil_table),
    of_pass("pass", "pass/pass.toml", spoil_text),
    of_pass("four", "four/gyro.csv", spoil_table),
    of_pass("four", "four/star_tracker_2.csv", spoil_table),
    of_pass("four", "four/pass.toml", spoil_text),
    of_pass("known", "known/prior.json", spoil_text),
    of_pass("known", "known/pass.toml", spoil_text),
    *[Target(f"telemetry/{file}", spoil, ["telemetry"], [
        ("import", "{in}/telemetry/telemetry.toml", "-o", "{out}/pass"), ("import", "{in}/telemetry/telemetry.toml", "-o", "{out}/pass.nc"),
        ("inspect", "{in}/telemetry/telemetry.toml"), ("--json", "inspect", "{in}/telemetry/telemetry.toml")])
      for file, spoil in (("telemetry.toml", spoil_text), ("gyros.csv", spoil_table), ("star_tracker.csv", spoil_table), ("slews.csv", spoil_table))],
    *[Target(f"{name}_packets/telemetry.{ending}", spoil, [f"{name}_packets", "told.toml"], [
        (*words, f"{{in}}/{name}_packets/telemetry.toml", *more) for words, more in (
            (("inspect",), ()), (("--json", "inspect"), ()), (("import",), ("-o", "{out}/pass")),
            (("calibrate",), ("-o", "{out}", "--config", "{in}/told.toml")),
            (("export",), ("--format", "packets", "-o", "{out}/t.ccsds")))])
      for name in ("pass", "four") for ending, spoil in (("ccsds", spoil_bytes), ("toml", spoil_text))],
    of_pass("pass.nc", "pass.nc", spoil_netcdf),
    of_pass("four.nc", "four.nc", spoil_netcdf),
    *[Target(f"pass/{truth}", spoil, ["pass", "attitude.csv", "calibration.json", "told.toml"], [
        ("evaluate", "{in}/pass", "--attitude", "{in}/attitude.csv"), CALIBRATE,
        ("navigate", "{in}/pass", "--calibration", "{in}/calibration.json", "-o", "{out}/a.csv")])
      for truth, spoil in (("truth.csv", spoil_table), ("truth.json", spoil_text))],
    Target("calibration.json", spoil_text, ["pass"], [
        ("navigate", "{in}/pass", "--calibration", "{in}/calibration.json", "-o", "{out}/a.csv"),
        ("navigate", "{in}/pass", "--calibration", "{in}/calibration.json", "-o", "{out}/a.csv", "--correction-interval", "30s")]),
    Target("replay.state", spoil_bytes, ["pass"], [
        ("replay", "{in}/pass", "--speed", "max", "--calibration", "{out}/c.json", "--state", "{in}/replay.state", "--resume")], ["replay.state"]),
    Target("config.toml", spoil_text, ["pass"], [
        ("calibrate", "{in}/pass", "-o", "{out}", "--config", "{in}/config.toml"), ("observe", "{in}/pass", "--config", "{in}/config.toml"),
        ("navigate", "{in}/pass", "--online", "--config", "{in}/config.toml", "-o", "{out}/a.csv")]),
    *[Target(f"{scenario}.toml", spoil_text, ["attitude.csv"], [
        ("simulate", f"{{in}}/{scenario}.toml", "-o", "{out}/pass"), ("simulate", f"{{in}}/{scenario}.toml", "-o", "{out}/pass.nc"),
        ("observe", f"{{in}}/{scenario}.toml")]) for scenario in ("every", "every", "four", "recorded")],
    Target("orbit.oem", spoil_text, ["orbit.toml"], [("simulate", "{in}/orbit.toml", "-o", "{out}/pass")]),
    Target("attitude.csv", spoil_table, ["pass", "recorded.toml"], [
        ("evaluate", "{in}/pass", "--attitude", "{in}/attitude.csv"),
        ("simulate", "{in}/recorded.toml", "-o", "{out}/pass")]),
    *[Target(f"attitude.{form}", spoil_text, ["pass"], [
        ("import", f"{{in}}/attitude.{form}", "-o", "{out}/a.csv"), ("--json", "import", f"{{in}}/attitude.{form}", "-o", "{out}/a.csv"),
        ("evaluate", "{in}/pass", "--attitude", f"{{in}}/attitude.{form}"),
        ("export", f"{{in}}/attitude.{form}", "--format", "ck", "-o", "{out}/a.bc")]) for form in ("aem", "aem-xml", "apm", "apm-xml")],
    *[Target(f"attitude.{ending}", spoil, ["pass", f"attitude.{other}"], [
        ("import", "{in}/attitude.bc", "-o", "{out}/a.csv"), ("evaluate", "{in}/pass", "--attitude", "{in}/attitude.bc"),
        ("export", "{in}/attitude.bc", "--format", "aem", "-o", "{out}/a.aem")])
      for ending, spoil, other in (("bc", spoil_bytes, "tsc"), ("tsc", spoil_text, "bc"))],
    *[Target(f"calibration.{form}", spoil_text, ["calibration.covariance.nc"], [
        ("import", f"{{in}}/calibration.{form}", "-o", "{out}/c.json"),
        ("--json", "import", f"{{in}}/calibration.{form}", "-o", "{out}/c.json")]) for form in ("acm", "acm-xml")],
    Target("calibration.covariance.nc", spoil_netcdf, ["calibration.acm"], [("import", "{in}/calibration.acm", "-o", "{out}/c.json")]),
    Target("attitude.csv", spoil_table, ["pass"], [
        ("export", "{in}/attitude.csv", "--format", form, "-o", "{out}/a.x", "--pass", "{in}/pass") for form in ("aem", "aem-xml", "ck")]),
    Target("calibration.json", spoil_text, ["pass", "attitude.csv"], [
        ("export", "{in}/calibration.json", "--format", form, "-o", "{out}/c.x", *more)
        for form, more in (("acm", ("--attitude", "{in}/attitude.csv", "--pass", "{in}/pass")), ("acm-xml", ()), ("fk", ()))]),
    Target("catalogue.db", spoil_catalogue, [], [
        ("history", "{in}/catalogue.db"), ("--json", "history", "{in}/catalogue.db"), ("history", "{in}/catalogue.db", "-o", "{out}/h.html")]),
    Target("catalogue.db", spoil_catalogue, ["pass", "told.toml"], [(*CALIBRATE, "--catalogue", "{in}/catalogue.db")], ["catalogue.db"]),
]


def contents(directory):
    """Path and bytes of everything below."""
    return {str(path.relative_to(directory)): path.read_bytes() if path.is_file() else None for path in sorted(directory.rglob("*"))}


def limit_resources():
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_CPU_S, LIMIT_CPU_S + 1))
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE_BYTES, ADDRESS_SPACE_BYTES))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


Run = collections.namedtuple("Run", "status stdout stderr seconds memory")


def run(command, directory):
    """Ends it after LIMIT_CPU_S or LIMIT_S, with status None."""
    environment = {**os.environ, "TMPDIR": str(directory / "tmp"), "HOME": str(directory / "tmp")}
    with open(directory / "stdout", "wb") as stdout, open(directory / "stderr", "wb") as stderr:
        process = subprocess.Popen(command, cwd=directory, stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr, env=environment,
                                   preexec_fn=limit_resources)
        late = threading.Event()

        def end():
            late.set()
            process.kill()

        timer = threading.Timer(LIMIT_S, end)
        timer.start()
        _, wait_status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(wait_status)
    outputs = [(directory / name).read_bytes() for name in ("stdout", "stderr")]
    hangs = late.is_set() or process.returncode == -signal.SIGXCPU
    return Run(None if hangs else process.returncode, *outputs, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024)


def faults(done, before, directory, may_change):
    """What is wrong with a run; nothing, where it kept to its limits."""
    if done.status is None:
        return [f"does not end within {LIMIT_CPU_S} s of processor time, or {LIMIT_S} s"]
    found = []
    if not TRUSTWORTHY <= done.status <= INPUT_REFUSED:
        name = signal.Signals(-done.status).name if done.status < 0 else f"status {done.status}"
        found.append(f"ends with {name}")
    if done.memory > LIMIT_BYTES:
        found.append(f"takes {done.memory >> 20} MB")
    refused = done.status not in (TRUSTWORTHY, DO_NOT_USE)
    try:
        message = done.stderr.decode()
        done.stdout.decode()
    except UnicodeDecodeError:
        return [*found, "prints what is no UTF-8"]
    if refused and not (message.startswith("trihedron: ") and message.endswith("\n") and message.count("\n") == 1):
        found.append(f"says not one line, but {message[-300:]!r}")
    if not refused and message:
        found.append(f"says {message[:300]!r} though it is done")
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f]", message.replace("\n", "") + done.stdout.decode().replace("\r", "")):
        found.append("prints control characters")
    if refused and done.stdout:
        found.append(f"has printed something before: {done.stdout[:100]!r}")
    after = contents(directory / "in")
    changed = sorted(name for name in {*before, *after} if before.get(name, "absent") != after.get(name, "absent"))
    if [name for name in changed if refused or name not in may_change]:
        found.append(f"changes its input: {changed}")
    if sorted(os.listdir(directory)) != ["in", "out", "stderr", "stdout", "tmp"]:
        found.append(f"writes beside its output: {sorted(os.listdir(directory))}")
    if os.listdir(directory / "tmp"):
        found.append(f"leaves temporary files: {os.listdir(directory / 'tmp')}")
    if refused and contents(directory / "out"):
        found.append(f"writes {sorted(contents(directory / 'out'))} though it refuses")
    return found


class Tester:
    def __init__(self, program, seed, originals, keep):
        self.program, self.seed, self.originals, self.keep = program, seed, originals, keep

    def made(self, number, directory):
        """The command of input `number`, with its spoilt file in `directory`; and its target."""
        rng = random.Random(f"{self.seed}:{number}")
        target = TARGETS[number % len(TARGETS)]
        command = rng.choice(target.commands)
        (directory / "in").mkdir(parents=True)
        (directory / "out").mkdir()
        (directory / "tmp").mkdir()
        for name in [*target.needs, target.file]:
            source, copy = self.originals / name, directory / "in" / name
            if source.is_dir():
                shutil.copytree(source, copy)
            elif not copy.exists():
                shutil.copy(source, copy)
        spoilt = target.spoil(rng, (self.originals / target.file).read_bytes())
        (directory / "in" / target.file).write_bytes(spoilt)
        return [self.program, *(word.format(**{"in": directory / "in", "out": directory / "out"}) for word in command)], target

    def test(self, number):
        with tempfile.TemporaryDirectory(prefix="trihedron-mutation-") as name:
            directory = pathlib.Path(name, "case")
            command, target = self.made(number, directory)
            before = contents(directory / "in")
            done = run(command, directory)
            found = faults(done, before, directory, target.changes)
            if self.keep:
                shutil.copytree(directory, pathlib.Path(self.keep, str(number)), dirs_exist_ok=True)
        words = " ".join(word.replace(str(directory) + "/", "") for word in command[1:])
        return number, target.file, words, done, found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--inputs", type=int, default=1200)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", type=int, help="one input of the seed; its messages are shown")
    parser.add_argument("--keep", help="directory for the files of each input that is run")
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="trihedron-originals-") as name:
        originals = pathlib.Path(name)
        Originals(program, pathlib.Path(__file__).resolve().parents[2] / "examples", originals)
        tester = Tester(program, arguments.seed, originals, arguments.keep)
        numbers = range(arguments.inputs) if arguments.only is None else [arguments.only]
        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            results = list(pool.map(tester.test, numbers))
    if arguments.only is not None:
        _, _, words, done, _ = results[0]
        print(f"trihedron {words}\nstatus {done.status}, {done.seconds:.2f} s of processor time, {done.memory >> 20} MB\n{done.stderr.decode(errors='replace')}",
              end="")
    failed = [result for result in results if result[4]]
    for number, file, words, _, found in failed:
        print(f"input {number} of seed {arguments.seed}, {file} spoilt, trihedron {words}: {'; '.join(found)}\n"
              f"    {sys.argv[0]} {arguments.program} --seed {arguments.seed} --only {number} --keep DIRECTORY")
    statuses = collections.Counter(result[3].status for result in results)
    slowest = max(results, key=lambda result: result[3].seconds)
    largest = max(results, key=lambda result: result[3].memory)
    print(json.dumps({"seed": arguments.seed, "inputs": len(results), "failed": len(failed),
                      "statuses": {str(status): count for status, count in sorted(statuses.items(), key=str)},
                      "longest_cpu_s": round(slowest[3].seconds, 2), "longest_input": slowest[0], "most_mb": largest[3].memory >> 20,
                      "largest_input": largest[0], "took_s": round(time.monotonic() - begun)}))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
