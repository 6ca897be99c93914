"""A command that is interrupted ends at once, by the signal, and leaves nothing half-written. Run by CTest with TRIHEDRON_BUILD naming
the build directory."""
import itertools
import os
import resource
import signal
import subprocess
import time
from pathlib import Path

import pytest

from program import PROGRAM, TOLD

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LIMIT_S = 2  # of processor time


def begin(*command):
    return subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def processor_time_s(usage):
    return usage.ru_utime + usage.ru_stime


def stop(process, with_signal):
    """Seconds of processor time that it takes from the signal on until it ends."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    used_s = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")  # its own, and that of processes that it has waited for
    others_s = processor_time_s(resource.getrusage(resource.RUSAGE_CHILDREN))
    process.send_signal(with_signal)
    process.communicate(timeout=60)
    return processor_time_s(resource.getrusage(resource.RUSAGE_CHILDREN)) - others_s - used_s


def files_below(directory):
    return sorted(str(path.relative_to(directory)) for path in directory.rglob("*"))


def simulated(directory, hours):
    (directory / "scenario.toml").write_text(f'[scenario]\nseed = 3\nduration = "{60 * hours}min"\n')
    subprocess.run([str(PROGRAM), "--quiet", "simulate", directory / "scenario.toml", "-o", directory / "pass.nc"], check=True)
    return directory / "pass.nc"


@pytest.fixture(scope="module")
def half_a_day(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("half_a_day"), 12)


@pytest.fixture(scope="module")
def hour(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("hour"), 1)


@pytest.fixture(scope="module")
def two_hours(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("two_hours"), 2)


@pytest.mark.long
@pytest.mark.parametrize("with_signal, after_s", [*itertools.product(SIGNALS, [0.02, 0.3]), *zip(SIGNALS, [0.6, 1.4, 2.8])])
def test_a_long_calibration_ends_at_once(half_a_day, tmp_path, with_signal, after_s):
    process = begin(PROGRAM, "calibrate", half_a_day, "-o", tmp_path / "above" / "out", "--estimator", "batch", "--definitive")
    time.sleep(after_s)
    assert process.poll() is None, process.communicate()
    assert stop(process, with_signal) < LIMIT_S
    assert process.returncode == -with_signal
    assert files_below(tmp_path) == []


@pytest.mark.long
@pytest.mark.parametrize("arguments", [
    ("navigate", "{pass}", "-o", "{out}/attitude.csv", "--online"),
    ("simulate", "{scenario}", "-o", "{out}/again"),
    ("simulate", "{scenario}", "-o", "{out}/again.nc"),
    ("observe", "{steady}", "--advise", "--slews", "1", "--confirm", "1000", "--config", "{told}"),
])
def test_other_long_commands_end_at_once(half_a_day, tmp_path, arguments):
    out = tmp_path / "out"
    names = {"pass": half_a_day, "out": out}
    for name, text in (("scenario", '[scenario]\nduration = "24h"\n'), ("told", TOLD),
                       ("steady", '[scenario]\nseed = 2\nduration = "80min"\n[attitude]\nslews = "none"\n')):
        names[name] = tmp_path / f"{name}.toml"
        names[name].write_text(text)
    # Of observe with nothing to decide, the last of these finds flights that confirm what is advised.
    for after_s, with_signal in ((0.1, signal.SIGTERM), (0.4, signal.SIGINT), *([(2.5, signal.SIGINT)] if "observe" in arguments else [])):
        out.mkdir(exist_ok=True)
        process = begin(PROGRAM, *(argument.format(**names) for argument in arguments))
        time.sleep(after_s)
        assert process.poll() is None, process.communicate()
        assert stop(process, with_signal) < LIMIT_S
        assert process.returncode == -with_signal
        assert files_below(out) == []


def test_whenever_it_is_interrupted_all_files_are_there_or_none(hour, tmp_path):
    (tmp_path / "told.toml").write_text(TOLD)
    arguments = (PROGRAM, "calibrate", hour, "--config", tmp_path / "told.toml", "-o")
    began = time.monotonic()
    subprocess.run([*map(str, arguments), str(tmp_path / "whole")], check=False, capture_output=True)
    needs_s = time.monotonic() - began
    whole = files_below(tmp_path / "whole")
    assert "report.html" in whole
    for moment in range(12):
        out = tmp_path / f"out{moment}"
        process = begin(*arguments, out)
        time.sleep(needs_s * (moment + 0.5) / 11)
        stop(process, SIGNALS[moment % 2])
        assert process.returncode in (-SIGNALS[moment % 2], 0, 1)
        assert process.returncode < 0 or files_below(out) == whole
        assert not out.exists() or files_below(out) == whole


def test_files_of_an_earlier_run_stay_as_they_were(two_hours, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "calibration.json").write_text("earlier")
    process = begin(PROGRAM, "calibrate", two_hours, "-o", out, "--estimator", "batch")
    time.sleep(0.2)
    assert process.poll() is None, process.communicate()
    stop(process, signal.SIGINT)
    assert process.returncode == -signal.SIGINT
    assert files_below(tmp_path) == ["out", "out/calibration.json"]
    assert (out / "calibration.json").read_text() == "earlier"


def test_a_signal_that_is_ignored_stays_ignored(two_hours, tmp_path):
    (tmp_path / "told.toml").write_text(TOLD)
    process = subprocess.Popen(
        [str(PROGRAM), "--quiet", "calibrate", str(two_hours), "-o", str(tmp_path / "out"), "--config", str(tmp_path / "told.toml")],
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    time.sleep(0.1)
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=60) in (0, 1)
    assert (tmp_path / "out" / "report.html").exists()
