"""What a command writes is there as a whole or not at all, whatever fails; what it is given is never lost. Run by CTest with TRIHEDRON_BUILD
naming the build directory. TRIHEDRON_FAULTS=all lets every call fail that can, which takes minutes; else a part is taken by seed."""
import concurrent.futures
import contextlib
import errno
import fcntl
import itertools
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import sqlite3
import stat
import subprocess
import time

import pytest

import program
from program import DO_NOT_USE, INPUT_REFUSED, MACHINE_FAILED, PROGRAM, TOLD, TRUSTWORTHY, WRONG_USAGE, refused

DONE = (TRUSTWORTHY, DO_NOT_USE)
ALL_FAULTS = os.environ.get("TRIHEDRON_FAULTS") == "all"
SCENARIO = '[scenario]\nseed = {}\nduration = "4min"\n[gyro]\nperiod = "1s"\n'
FILES = ["attitude.csv", "calibration.json", "effective-config.toml", "report.html", "residuals.nc"]


def run(*arguments, **options):
    return program.run("--quiet", *arguments, errors="replace", **options)


def done(*arguments, **options):
    result = run(*arguments, **options)
    assert result.returncode in DONE, result.stderr
    return result


def content(directory):
    """Of each file below it, hidden ones too."""
    return {os.fsencode(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def without_hidden(directory):
    return {name: text for name, text in content(directory).items() if b".trihedron-" not in name}


@pytest.fixture(scope="session")
def given(tmp_path_factory):
    """Passes of four minutes, as directories with a truth and as NetCDF, and settings. Not to be changed."""
    directory = tmp_path_factory.mktemp("given")
    (directory / "told.toml").write_text(TOLD)
    for seed, name in enumerate(("first", "second")):
        (directory / f"{name}.toml").write_text(SCENARIO.format(seed))
        done("simulate", directory / f"{name}.toml", "-o", directory / name)
        done("simulate", directory / f"{name}.toml", "-o", directory / f"{name}.nc")
    shutil.copytree(directory / "first", directory / "parallel")  # both momenta on one line: refused once the work has begun
    lines = [line.split(",") for line in (directory / "first" / "gyro.csv").read_text().splitlines()]
    (directory / "parallel" / "gyro.csv").write_text("\n".join(
        ",".join(line if i == 0 else line[:4] + [f"{-float(h):.9f}" for h in line[1:4]]) for i, line in enumerate(lines)) + "\n")
    return directory


@pytest.fixture
def calibrate(given):
    return lambda *arguments, **options: run("calibrate", *arguments, "--config", given / "told.toml", **options)


@pytest.fixture
def own(given, tmp_path):
    """A copy of the first pass that a test may spoil."""
    return shutil.copytree(given / "first", tmp_path / "pass")


# An output is no input.


@pytest.mark.parametrize("output", ["{pass}", "{pass}/", "{pass}/out", "{pass}/../pass", "{link}", "{link}/out"])
def test_a_calibration_is_not_written_into_its_pass(own, tmp_path, calibrate, output):
    (tmp_path / "link").symlink_to(own)
    before = content(own)
    refused(calibrate(own, "-o", output.format(**{"pass": own, "link": tmp_path / "link"})), WRONG_USAGE, "input")
    assert content(own) == before


def test_a_calibration_does_not_replace_its_prior_its_settings_or_its_catalogue(given, own, tmp_path, calibrate):
    out = tmp_path / "out"
    done("calibrate", own, "-o", out, "--config", given / "told.toml")
    (own / "pass.toml").write_text((own / "pass.toml").read_text().replace("[pass]", '[pass]\nprior = "../out/calibration.json"', 1))
    before = content(tmp_path)
    refused(calibrate(own, "-o", out), WRONG_USAGE, "calibration.json")
    refused(run("calibrate", given / "first", "-o", out, "--config", out / "effective-config.toml"), WRONG_USAGE, "effective-config.toml")
    refused(calibrate(given / "first", "-o", out, "--catalogue", out / "report.html"), WRONG_USAGE, "report.html")
    refused(calibrate(given / "first", "-o", out, "--catalogue", given / "first" / "c.db"), WRONG_USAGE, "c.db")
    assert content(tmp_path) == before
    assert calibrate(own, "-o", tmp_path / "other").returncode in DONE


def test_a_calibration_of_several_does_not_write_into_one_of_them(given, tmp_path, calibrate):
    for name in ("first", "second"):
        shutil.copytree(given / name, tmp_path / name)
    before = content(tmp_path)
    refused(calibrate(tmp_path / "first", tmp_path / "second", "-o", tmp_path), WRONG_USAGE, "first")
    assert content(tmp_path) == before


def test_an_own_earlier_output_is_replaced(given, tmp_path, calibrate):
    out = tmp_path / "out"
    for pass_name, below in (("second", "."), ("first", "."), ("first", ".")):
        assert calibrate(given / pass_name, "-o", out / below).returncode in DONE
    shutil.copy(given / "first.nc", out / "pass.nc")  # as demo does
    assert calibrate(out / "pass.nc", "-o", out).returncode in DONE
    assert sorted(path.name for path in out.iterdir()) == sorted([*FILES, "pass.nc"])
    assert (out / "pass.nc").read_bytes() == (given / "first.nc").read_bytes()


def test_a_pass_that_is_replaced_is_told(given, tmp_path):
    replaced = ", in place of the pass that was there\n"
    for name in ("pass", "pass.nc"):
        for arguments in (("simulate", given / "first.toml"), ("import", given / "second")):
            output = tmp_path / f"{arguments[0]}-{name}"
            assert program.run(*arguments, "-o", output).stdout.endswith(f"Written     {output}\n")
            assert program.run(*arguments, "-o", output).stdout.endswith(f"Written     {output}{replaced}")


def test_a_navigation_destroys_nothing_it_reads(given, own, tmp_path):
    done("calibrate", own, "-o", tmp_path / "out", "--config", given / "told.toml")
    shutil.copy(given / "first.nc", tmp_path / "p.nc")
    os.link(own / "gyro.csv", tmp_path / "second-name")
    (tmp_path / "to-gyro").symlink_to(own / "gyro.csv")
    calibration = tmp_path / "out" / "calibration.json"
    before = content(tmp_path)
    for arguments in ((tmp_path / "p.nc", "--prior", "-o", tmp_path / "p.nc"), (own, "--prior", "-o", own / "gyro.csv"),
                      (own, "--prior", "-o", own / "new.csv"), (own, "--prior", "-o", tmp_path / "second-name"),
                      (own, "--prior", "-o", tmp_path / "to-gyro"), (own, "--calibration", calibration, "-o", calibration)):
        refused(run("navigate", *arguments), WRONG_USAGE, arguments[-1])
    config = tmp_path / "out" / "effective-config.toml"
    refused(run("navigate", own, "--prior", "--config", config, "-o", config), WRONG_USAGE, "effective-config.toml")
    assert content(tmp_path) == before
    done("navigate", own, "--calibration", calibration, "-o", tmp_path / "out" / "attitude.csv")


def test_a_history_does_not_replace_its_catalogue(given, tmp_path, calibrate):
    catalogue = tmp_path / "c.db"
    calibrate(given / "first", "-o", tmp_path / "out", "--catalogue", catalogue)
    (tmp_path / "link.html").symlink_to(catalogue)
    before = catalogue.read_bytes()
    for output in (catalogue, tmp_path / "out" / ".." / "c.db", tmp_path / "link.html"):
        refused(run("history", catalogue, "-o", output), WRONG_USAGE, output)
    assert catalogue.read_bytes() == before


def test_a_simulation_does_not_replace_its_scenario_or_its_attitude(given, own, tmp_path):
    scenario = own / "pass.toml"  # a name that a pass has as well
    scenario.write_text(SCENARIO.format(1))
    recorded = own / "truth.csv"
    before = content(own)
    refused(run("simulate", scenario, "-o", own), WRONG_USAGE, "pass.toml")
    refused(run("simulate", scenario, "-o", scenario), WRONG_USAGE, "pass.toml")
    other = tmp_path / "s.toml"
    other.write_text(SCENARIO.format(1) + '[attitude]\nreference = "recorded"\nrecorded = "pass/truth.csv"\n')
    refused(run("simulate", other, "-o", own), WRONG_USAGE, recorded)
    assert content(own) == before
    shutil.copy(given / "first.toml", own / "scenario.toml")
    done("simulate", own / "scenario.toml", "-o", own)


# What can be refused is refused before the work.


@pytest.mark.parametrize("command", ["calibrate", "navigate"])
def test_a_broken_truth_is_refused_before_anything_is_written(given, own, tmp_path, command):
    options = {"calibrate": ("--config", given / "told.toml"), "navigate": ("--online",)}[command]
    truth = (own / "truth.csv").read_text()
    for file, text in (("truth.csv", truth.replace("\n0.000,", "\n0.000,x", 1)), ("truth.csv", truth[:-20]), ("truth.json", "{")):
        shutil.copytree(given / "first", own, dirs_exist_ok=True)
        (own / file).write_text(text)
        refused(run(command, own, "-o", tmp_path / "out", *options), INPUT_REFUSED, file)
        assert not (tmp_path / "out").exists()


# Seen by a pass that is refused in the work itself: what is told is what came first.


def test_an_output_that_cannot_be_written_is_refused_before_the_work(given, tmp_path, calibrate):
    in_work = given / "parallel"
    refused(calibrate(in_work, "-o", tmp_path / "out"), INPUT_REFUSED, "parallel")
    (tmp_path / "file").write_text("mine")
    (tmp_path / "taken" / "report.html").mkdir(parents=True)
    for out in (tmp_path / "file" / "out", "/proc/trihedron", tmp_path / "taken"):
        refused(calibrate(in_work, "-o", out), MACHINE_FAILED, out)
    refused(calibrate(in_work, "-o", tmp_path / "file"), WRONG_USAGE, tmp_path / "file", "give the name of a directory")
    (tmp_path / "parallel").write_text("mine")
    later = shutil.copytree(given / "second", tmp_path / "in" / "later")
    (later / "pass.toml").write_text((later / "pass.toml").read_text().replace("2009-05-20T", "2009-05-21T"))
    refused(calibrate(in_work, later, "-o", tmp_path), MACHINE_FAILED, tmp_path / "parallel")
    shutil.rmtree(tmp_path / "in")
    (tmp_path / "parallel").unlink()
    refused(run("navigate", in_work, "--online", "-o", tmp_path / "none" / "a.csv"), MACHINE_FAILED, tmp_path / "none" / "a.csv")
    refused(run("navigate", in_work, "--online", "-o", tmp_path / "taken"), WRONG_USAGE, tmp_path / "taken", "give the name of a file")
    assert (tmp_path / "file").read_text() == "mine"
    assert content(tmp_path) == {b"file": b"mine"}


def test_a_simulation_refuses_its_output_before_the_work(tmp_path):
    overlapping = '[attitude]\nslews = [{begin = "10s", roll = "30deg"}, {begin = "11s"}]\n'  # which only the simulation finds
    (tmp_path / "impossible.toml").write_text(SCENARIO.format(1) + overlapping)
    refused(run("simulate", tmp_path / "impossible.toml", "-o", tmp_path / "pass"), INPUT_REFUSED, "impossible.toml", "raise max_slew_rate")
    (tmp_path / "file").write_text("mine")
    refused(run("simulate", tmp_path / "impossible.toml", "-o", tmp_path / "none" / "p.nc"), MACHINE_FAILED, tmp_path / "none" / "p.nc")
    refused(run("simulate", tmp_path / "impossible.toml", "-o", tmp_path / "file"), WRONG_USAGE, tmp_path / "file", "give the name of a directory")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "impossible.toml"]


def test_a_catalogue_that_cannot_be_written_is_refused_before_the_work(given, tmp_path, calibrate):
    in_work = given / "parallel"
    out, catalogue = tmp_path / "out", tmp_path / "c.db"
    assert calibrate(given / "first", "-o", out, "--catalogue", catalogue).returncode in DONE
    before = content(tmp_path)
    refused(calibrate(in_work, "-o", out, "--catalogue", tmp_path / "none" / "c.db"), MACHINE_FAILED, "c.db")
    with contextlib.closing(sqlite3.connect(catalogue)) as other:
        other.execute("BEGIN IMMEDIATE")
        refused(calibrate(in_work, "-o", out, "--catalogue", catalogue), MACHINE_FAILED, "c.db", "locked")
    (tmp_path / "notes.txt").write_text("not a database " * 100)
    refused(calibrate(in_work, "-o", out, "--catalogue", tmp_path / "notes.txt"), INPUT_REFUSED, "notes.txt")
    (tmp_path / "notes.txt").unlink()
    assert content(tmp_path) == before


# One writer at a time.


def test_the_second_of_two_writers_is_refused_at_once_and_told_who_is_first(given, tmp_path, calibrate):
    out = tmp_path / "out"
    out.mkdir()
    with open(out / ".trihedron-lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        lock.write("process 17 on another")
        lock.flush()
        refused(calibrate(given / "parallel", "-o", out), MACHINE_FAILED, out, "process 17 on another is writing into it")
        refused(run("simulate", given / "first.toml", "-o", out), MACHINE_FAILED, "process 17 on another")
        refused(run("demo", "-o", out), MACHINE_FAILED, "process 17 on another")
    assert calibrate(given / "first", "-o", out).returncode in DONE
    assert sorted(path.name for path in out.iterdir()) == FILES


def test_a_process_that_writes_names_itself(given, tmp_path, calibrate):
    (tmp_path / "long.toml").write_text('[scenario]\nduration = "24h"\n')
    first = subprocess.Popen([PROGRAM, "simulate", tmp_path / "long.toml", "-o", tmp_path / "out"], stderr=subprocess.DEVNULL)
    lock = tmp_path / "out" / ".trihedron-lock"
    while first.poll() is None and not (lock.exists() and lock.read_text()):
        time.sleep(0.002)
    try:
        refused(calibrate(given / "first", "-o", tmp_path / "out"), MACHINE_FAILED, f"process {first.pid} on {socket.gethostname()}")
    finally:
        first.terminate()
        first.wait()
    assert not (tmp_path / "out").exists()


def test_of_two_writers_one_set_stays(given, tmp_path, calibrate):
    sets = {}
    for name in ("first", "second"):
        assert calibrate(given / name, "-o", tmp_path / name).returncode in DONE
        sets[name] = content(tmp_path / name)
    for trial in range(8):
        out = tmp_path / f"out{trial}"
        both = [subprocess.Popen([PROGRAM, "--quiet", "calibrate", given / name, "-o", out, "--config", given / "told.toml"],
                                 stderr=subprocess.PIPE, text=True) for name in sets]
        errors = [process.communicate()[1] for process in both]
        statuses = [process.returncode for process in both]
        assert any(status in DONE for status in statuses), errors
        assert all(status in DONE or (status == MACHINE_FAILED and "is writing into it" in error)
                   for status, error in zip(statuses, errors)), (statuses, errors)
        assert content(out) in sets.values()


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_demonstration_is_one_set(tmp_path, number):
    """Stopped when its first files are made."""
    out = tmp_path / "out"
    process = subprocess.Popen([PROGRAM, "demo", "-o", out], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while process.poll() is None and not (out / ".trihedron-new" / "pass.nc").exists():
        time.sleep(0.01)
    process.send_signal(number)
    assert process.communicate()[1] == b"" and process.returncode == -number
    assert not out.exists() if number == signal.SIGINT else [path.name for path in out.iterdir() if path.name[0] != "."] == []


# Names, links, modes.


def test_links_and_modes_stay(given, tmp_path, calibrate):
    out = tmp_path / "out"
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "cal.json").write_text("old")
    (tmp_path / "elsewhere" / "cal.json").chmod(0o640)
    (tmp_path / "real").mkdir()
    out.symlink_to("real")
    (out / "calibration.json").symlink_to("../elsewhere/cal.json")
    (out / "report.html").write_text("old")
    (out / "report.html").chmod(0o600)
    assert calibrate(given / "first", "-o", out).returncode in DONE
    assert out.is_symlink() and (out / "calibration.json").is_symlink()
    assert json.loads((tmp_path / "elsewhere" / "cal.json").read_text())["format"] == "trihedron-calibration"
    assert stat.S_IMODE((tmp_path / "elsewhere" / "cal.json").stat().st_mode) == 0o640
    assert stat.S_IMODE((out / "report.html").stat().st_mode) == 0o600
    (tmp_path / "elsewhere" / "a.csv").write_text("old")
    (tmp_path / "a.csv").symlink_to("elsewhere/a.csv")
    done("navigate", given / "first", "--online", "-o", tmp_path / "a.csv")
    assert (tmp_path / "a.csv").is_symlink() and (tmp_path / "elsewhere" / "a.csv").read_text().startswith("t_s,")


@pytest.mark.parametrize("length", [249, 255])
def test_names_of_any_length_are_written(given, tmp_path, calibrate, length):
    name = "n" * (length - 4)
    done("navigate", given / "first", "--online", "-o", tmp_path / f"{name}.csv")
    done("simulate", given / "first.toml", "-o", tmp_path / f"{name}.nc.")  # a directory
    done("simulate", given / "first.toml", "-o", tmp_path / f"{name}x.nc")
    assert calibrate(tmp_path / f"{name}x.nc", "-o", tmp_path / f"{name}.out").returncode in DONE
    assert sorted(path.name for path in (tmp_path / f"{name}.out").iterdir()) == FILES
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.parametrize("path, name", [("..", "first"), (".", "first"), ("../first/", "first"), ("../link", "link"), ("../link/.", "first")])
def test_a_pass_never_writes_outside_out(given, tmp_path, calibrate, path, name):
    """By its name, where several are calibrated. The later one is of the next day."""
    work = tmp_path / "work"
    (work / "first" / "below").mkdir(parents=True)
    shutil.copytree(given / "first", work / "first", dirs_exist_ok=True)
    shutil.copytree(given / "second", work / "second")
    (work / "link").symlink_to("first")
    toml = work / "second" / "pass.toml"
    toml.write_text(toml.read_text().replace("2009-05-20T", "2009-05-21T"))
    before = content(work)
    where = work / "first" / ("below" if path == ".." else "")
    result = calibrate(path, work / "second", "-o", tmp_path / "out", cwd=where)
    assert result.returncode in DONE, result.stderr
    assert content(work) == before
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["out", "work"]
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir()) == sorted([*FILES, name, "second"])
    for below in (name, "second"):
        assert sorted(entry.name for entry in (tmp_path / "out" / below).iterdir()) == FILES


def test_passes_of_one_name_and_names_that_are_no_text_have_directories_of_their_own(given, tmp_path):
    paths = []
    for day, name in enumerate((b"a/p", b"b/p", b"c/p-2", b"d/\xff\x1b[1m", b"e/report.html")):
        path = os.fsencode(tmp_path) + b"/in/" + name
        shutil.copytree(os.fsencode(given / "first"), path)
        toml = pathlib.Path(os.fsdecode(path)) / "pass.toml"
        toml.write_text(toml.read_text().replace("2009-05-20T", f"2009-05-{20 + day}T"))
        paths.append(path)
    arguments = ("calibrate", *paths, "-o", tmp_path / "out", "--config", given / "told.toml", "--catalogue", tmp_path / "c.db")
    result = subprocess.run([PROGRAM, "--json", *arguments], capture_output=True, check=False)
    assert result.returncode in DONE, result.stderr
    names = ["p", "p-3", "p-2", "%FF%1B[1m", "report.html-2"]
    assert [each["name"] for each in json.loads(result.stdout)["passes"]] == names
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir() if entry.is_dir()) == sorted(names)
    history = subprocess.run([PROGRAM, "--json", "history", tmp_path / "c.db"], capture_output=True, check=True)
    assert {each["pass"] for each in json.loads(history.stdout)["calibrations"]} == set(names)


def test_a_set_drops_what_an_earlier_one_had_more(given, tmp_path, calibrate):
    out = tmp_path / "out"
    assert calibrate(given / "first", "-o", out, "--definitive").returncode in DONE
    assert (out / "definitive-attitude.csv").exists()
    assert calibrate(given / "first", "-o", out).returncode in DONE
    assert sorted(path.name for path in out.iterdir()) == FILES


# Faults of the machine, by a library that is loaded before the others (faults.c).

SPACE = "write,sync,create"
CHANGES = "write,sync,create,name"
BETWEEN = 3  # calls from the COMMIT of the catalogue to the rename that keeps the files
EVERYTHING = "read,write,sync,open,create,name"


@pytest.fixture(scope="session")
def faults(tmp_path_factory):
    library = tmp_path_factory.mktemp("faults") / "faults.so"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, pathlib.Path(__file__).parent / "faults.c"], check=True)
    return library


SERIAL = itertools.count()  # of copies


class Machine:
    """Runs a command on a copy of a state of a directory while the machine fails, by a plan of faults."""

    def __init__(self, library, below, state, command):
        self.library = library
        self.below = below
        self.state = state
        self.command = command  # of the directory with the copy

    def copy(self):
        return shutil.copytree(self.state, self.below / f"copy{next(SERIAL)}", symlinks=True)

    def run(self, directory, kinds, **plan):
        environment = {**os.environ, "LD_PRELOAD": str(self.library), "FAULTS_BELOW": str(plan.pop("below", self.below)), "FAULTS_CALLS": kinds,
                       **{f"FAULTS_{name.upper()}": str(value) for name, value in plan.items()}}
        return run(*self.command(directory), env=environment, timeout=60)

    def calls(self, kinds, **plan):
        """Those that a run without a fault makes: of each its kind and its file."""
        directory = self.copy()
        log = self.below / f"log{next(SERIAL)}"
        result = self.run(directory, kinds, log=log, **plan)
        assert result.returncode in DONE, result.stderr
        shutil.rmtree(directory)
        return log.read_text().splitlines()


def chosen(calls, most, seed):
    """Their numbers, from 1: of all, or of a part by seed that has the first and the last. It is of those that differ from the call before or from
    the one after: nine tenths of all calls are writes to one file, one after the other."""
    numbers = range(1, len(calls) + 1)
    if ALL_FAULTS:
        return list(numbers)
    ends = [number for number, before, call, after in zip(numbers, [None, *calls], calls, [*calls[1:], None]) if before != call or call != after]
    return ends if len(ends) <= most else sorted({ends[0], ends[-1], *random.Random(seed).sample(ends, most - 2)})


def on_all(work, items):
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, items))


def catalogue_rows(file):
    if not file.exists() or file.stat().st_size == 0:
        return set()
    with contextlib.closing(sqlite3.connect(file)) as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        return set(database.execute("SELECT pass, start_up, passes, json FROM calibration"))


@pytest.fixture(scope="session")
def second_after_first(given, faults, tmp_path_factory):
    """The second pass calibrated where the first has been: its Machine, and the two states that there may be afterwards."""
    below = tmp_path_factory.mktemp("below").resolve()
    shutil.copytree(given, below / "given")

    def command(directory, name="second"):
        return ("calibrate", below / "given" / name, "-o", directory / "out", "--config", below / "given" / "told.toml",
                "--catalogue", directory / "c.db")

    state = tmp_path_factory.mktemp("state")
    done(*command(state, "first"))
    (state / "out" / "mine.txt").write_text("not of this program")
    (state / "out" / "definitive-attitude.csv").write_text("goes with the old set")
    machine = Machine(faults, below, state, command)
    after = machine.copy()
    done(*command(after))
    machine.old = (content(state / "out"), catalogue_rows(state / "c.db"))
    machine.new = (content(after / "out"), catalogue_rows(after / "c.db"))
    assert machine.old[0] != machine.new[0] and machine.old[1] < machine.new[1]
    return machine


def is_new(machine, directory, may_be_left=()):
    """Whether OUT and the catalogue are the new ones, each. Fails where one is neither the old nor the new one, or anything else is there."""
    out, rows = content(directory / "out"), catalogue_rows(directory / "c.db")
    assert out in (machine.old[0], machine.new[0]), sorted(out)
    assert rows in (machine.old[1], machine.new[1]), rows
    assert {path.name for path in directory.iterdir()} - set(may_be_left) == {"c.db", "out"}
    return out == machine.new[0], rows == machine.new[1]


def take_up(machine, directory):
    """The next run, which is refused once it has begun its work."""
    refused(run(*machine.command(directory, "parallel")), INPUT_REFUSED, "parallel")


@pytest.mark.long
@pytest.mark.parametrize("error, kinds, lasting, most", [
    (errno.ENOSPC, SPACE, True, 25),
    (errno.ENOSPC, SPACE, False, 20),
    (errno.EIO, CHANGES, False, 30),
])
def test_a_disk_that_is_full_or_fails_at_any_call_leaves_old_or_new(second_after_first, error, kinds, lasting, most):
    machine = second_after_first

    def fail_at(call):
        directory = machine.copy()
        result = machine.run(directory, kinds, do=f"errno {error}", first=call, last=10**9 if lasting else call, below=directory)
        if result.returncode not in DONE:
            refused(result, MACHINE_FAILED)
        took = [b.startswith(b".trihedron-") for b in content(directory / "out")]
        if any(took):  # it could not clear up: the next run does
            assert "name" in kinds
            take_up(machine, directory)
        both = is_new(machine, directory)
        shutil.rmtree(directory)
        return result, both

    calls = machine.calls(kinds)
    assert len(calls) > 100
    outcomes = on_all(fail_at, chosen(calls, most, seed=error))
    assert any(result.returncode == MACHINE_FAILED for result, _ in outcomes)
    for result, (out, catalogue) in outcomes:
        assert result.returncode == MACHINE_FAILED or (out and catalogue)
    apart = [(result, both) for result, both in outcomes if both[0] != both[1]]
    assert len(apart) <= 1  # where the files cannot be made final once their entries are in the catalogue, see CatalogueUpdate
    for result, both in apart:
        assert both == (False, True) and "/out: cannot be written" in result.stderr


@pytest.mark.long
@pytest.mark.parametrize("form", ["directory", "netcdf"])
def test_a_disk_that_cannot_be_read_leaves_old(second_after_first, form):
    machine = second_after_first
    plain = machine.command
    machine = Machine(machine.library, machine.below, machine.state,
                      lambda directory: [str(a) + (".nc" if form == "netcdf" and str(a).endswith("/second") else "") for a in plain(directory)])
    machine.old, machine.new = second_after_first.old, second_after_first.new

    def fail_at(call):
        directory = machine.copy()
        result = machine.run(directory, "read", do=f"errno {errno.EIO}", first=call, last=call)
        if result.returncode not in DONE:
            # SQLite and HDF5 do not tell all faults of the disk from those of the file.
            by_library = "c.db" in result.stderr or form == "netcdf"
            refused(result, INPUT_REFUSED if by_library and result.returncode == INPUT_REFUSED else MACHINE_FAILED)
            assert is_new(machine, directory) == (False, False)
        shutil.rmtree(directory)
        return result.returncode

    outcomes = on_all(fail_at, chosen(machine.calls("read"), 20, seed=2))
    assert set(outcomes) & {INPUT_REFUSED, MACHINE_FAILED}


@pytest.mark.long
def test_reads_and_writes_that_fall_short_change_nothing(second_after_first):
    machine = second_after_first
    directory = machine.copy()
    result = machine.run(directory, "read,write", do="short", first=1, last=10**9)
    assert result.returncode in DONE, result.stderr
    assert is_new(machine, directory) == (True, True)


@pytest.mark.long
@pytest.mark.parametrize("number, most", [(signal.SIGINT, 25), (signal.SIGTERM, 25)])
def test_a_signal_at_any_call_leaves_old_or_new_and_nothing_else(second_after_first, number, most):
    machine = second_after_first

    def stop_at(call):
        directory = machine.copy()
        result = machine.run(directory, EVERYTHING, do=f"signal {int(number)}", first=call, last=call)
        both = is_new(machine, directory)
        shutil.rmtree(directory)
        return result, both

    for result, (out, catalogue) in on_all(stop_at, chosen(machine.calls(EVERYTHING), most, seed=int(number))):
        assert result.returncode == -number and result.stderr == ""
        assert out == catalogue


@pytest.mark.long
def test_a_kill_at_any_call_leaves_old_or_new_after_the_next_run(second_after_first):
    machine = second_after_first
    calls = machine.calls(EVERYTHING)
    changes = machine.calls("create,name")  # at each of them

    def kill_at(moment):
        kinds, call = moment
        directory = machine.copy()
        result = machine.run(directory, kinds, do=f"signal {int(signal.SIGKILL)}", first=call, last=call)
        assert result.returncode == -signal.SIGKILL
        if call % 3 == 0:
            done("history", directory / "c.db")  # can be read after that
        take_up(machine, directory)
        # SQLite removes a journal in which nothing was begun when it writes the next time.
        both = is_new(machine, directory, may_be_left=["c.db-journal"])
        if call % 3 == 1:
            done(*machine.command(directory))
            assert is_new(machine, directory) == (True, True)
        shutil.rmtree(directory)
        return both

    moments = [(EVERYTHING, call) for call in chosen(calls, 15, seed=9)] + [("create,name", call + 1) for call in range(len(changes))]
    outcomes = on_all(kill_at, moments)
    assert (False, False) in outcomes and (True, True) in outcomes
    assert (True, False) not in outcomes  # files without entries
    # Entries without files: only between the two, see CatalogueUpdate. Both kinds of moments can meet it.
    assert outcomes.count((False, True)) <= 2 * BETWEEN


@pytest.mark.long
@pytest.mark.parametrize("name", ["pass", "pass.nc", "a.csv", "h.html"])
def test_other_outputs_are_old_or_new_after_any_fault(given, faults, tmp_path, name):
    below = tmp_path.resolve() / "below"
    shutil.copytree(given, below / "given")
    state = tmp_path / "state"
    state.mkdir()
    done("calibrate", given / "first", "-o", tmp_path / "out", "--config", given / "told.toml", "--catalogue", below / "given" / "c.db")

    def command(directory, which="second"):
        if name.startswith("pass"):
            return "simulate", below / "given" / f"{which}.toml", "-o", directory / name
        if name == "a.csv":
            return "navigate", below / "given" / which, "--online", "-o", directory / name
        return "history", below / "given" / "c.db", "-o", directory / name

    if name == "h.html":
        (state / name).write_text("old")
    else:
        done(*command(state, "first"))
    machine = Machine(faults, below, state, command)
    after = machine.copy()
    done(*command(after))
    old, new = content(state), content(after)
    assert old != new

    def fail_at(plan):
        do, call, kinds = plan
        directory = machine.copy()
        result = machine.run(directory, kinds, do=do, first=call, last=call, below=directory)
        if do.startswith("errno"):
            assert result.returncode in DONE or result.returncode == MACHINE_FAILED, (plan, result.stderr)
            assert result.returncode == MACHINE_FAILED or without_hidden(directory) == new
        else:
            assert result.returncode == -int(do.split()[1])
        if do == f"signal {int(signal.SIGKILL)}" or "name" in kinds:
            # Nothing left behind after the next run, which here is refused before it writes.
            if name == "pass":
                taken = run("simulate", given / "parallel", "-o", directory / name)
                assert taken.returncode == INPUT_REFUSED
                done(*command(directory))
            else:
                done(*command(directory))
            assert content(directory) == new
        assert content(directory) in (old, new), (plan, sorted(content(directory)))
        shutil.rmtree(directory)
        return result.returncode

    plans = []
    for do, kinds in ((f"errno {errno.ENOSPC}", SPACE), (f"errno {errno.EIO}", CHANGES), (f"signal {int(signal.SIGKILL)}", CHANGES),
                      (f"signal {int(signal.SIGTERM)}", SPACE), (f"signal {int(signal.SIGHUP)}", SPACE)):
        calls = machine.calls(kinds, below=below)
        plans += [(do, call, kinds) for call in chosen(calls, 5, seed=len(calls))]
    assert MACHINE_FAILED in on_all(fail_at, plans)


def test_a_reader_that_has_gone_ends_a_command_by_sigpipe_and_leaves_nothing(given, tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    result = subprocess.run([PROGRAM, "calibrate", given / "first", "-o", tmp_path / "out", "--config", given / "told.toml"], stdout=writing,
                            stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (result.returncode, result.stderr) == (-signal.SIGPIPE, b"")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
