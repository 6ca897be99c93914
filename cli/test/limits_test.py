"""Numbers at and beyond their ranges, closed streams, and memory: what the program does at its limits. Run by CTest with TRIHEDRON_BUILD naming
the build directory."""
import os
import re
import subprocess

import pytest

from program import DO_NOT_USE, INPUT_REFUSED, MACHINE_FAILED, PROGRAM, TRUSTWORTHY, WRONG_USAGE, refused, run

ESTIMATORS = ("invariant", "paper", "batch")


def simulated(directory, name, scenario):
    file = directory / "scenario.toml"
    file.write_text(scenario)
    result = run("--quiet", "simulate", file, "-o", directory / name)
    assert result.returncode == TRUSTWORTHY, result.stderr
    return directory / name


@pytest.fixture(scope="module")
def short_pass(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("short"), "pass", '[scenario]\nduration = "4min"\n')


@pytest.fixture
def edited(short_pass, tmp_path):
    """The short pass with one line of pass.toml replaced; the telemetry is shared."""

    def make(key, line):
        directory = tmp_path / "pass"
        directory.mkdir(exist_ok=True)
        for table in ("gyro.csv", "star_tracker.csv"):
            (directory / table).unlink(missing_ok=True)
            (directory / table).symlink_to(short_pass / table)
        text = (short_pass / "pass.toml").read_text()
        edited_text = re.sub(rf"^{key} = .*$", line, text, count=1, flags=re.MULTILINE)
        assert edited_text != text
        (directory / "pass.toml").write_text(edited_text)
        return directory

    return make


# Numbers.


@pytest.mark.parametrize("key, value, words", [
    ("drift_prior_sigma_rad_s", "100", ("pass.toml:", "is 100 rad/s, outside 1e-15 to 0.01 rad/s")),
    ("drift_prior_sigma_rad_s", "1e30", ("outside", "no gyro drifts")),
    ("noise_rad", "[1e100, 1e100, 1e100]", ("is 1e+100 rad", "it is the 1-sigma of an attitude")),
    ("readout_noise_rad", "2", ("is 2 rad, outside 1e-09 to 0.1 rad",)),
    ("period_s", "125", ("is 125 s, outside 1e-05 to 60 s", "0.125 s for 8 Hz")),
])
def test_numbers_that_are_no_measurements_are_refused_with_their_bounds(edited, tmp_path, key, value, words):
    directory = edited(key, f"{key} = {value}")
    for command in (("inspect",), ("calibrate", "--estimator", "paper", "-o", tmp_path / "out"), ("navigate", "--online", "-o", tmp_path / "a")):
        refused(run(command[0], directory, *command[1:]), INPUT_REFUSED, key, *words)


@pytest.mark.parametrize("told, words", [
    ("12.5", ("gyro.csv", "has a row every 0.125 s", "pass.toml is 12.5 s", "set period_s = 0.125 there")),
    ("0.000125", ("gyro.csv", "the times t_s look like milliseconds")),
])
def test_a_period_that_the_samples_do_not_have_is_refused(edited, told, words):
    refused(run("inspect", edited("period_s", f"period_s = {told}")), INPUT_REFUSED, *words)


def test_a_calibration_that_no_gyro_has_is_refused(short_pass, tmp_path):
    assert run("--quiet", "calibrate", short_pass, "-o", tmp_path / "out").returncode in (TRUSTWORTHY, DO_NOT_USE)
    text = (tmp_path / "out" / "calibration.json").read_text()
    for edit, word in ((lambda t: re.sub(r'"k0":[^,}]+', '"k0":1e10', t, count=1), "gyros[0].drift_rad_s.k0"),
                       (lambda t: re.sub(r'("matrix": \[\s*\[)[^,]+', r"\g<1>1e50", t, count=1), "covariance.matrix")):
        file = tmp_path / "edited.json"
        file.write_text(edit(text))
        assert file.read_text() != text
        refused(run("navigate", short_pass, "-o", tmp_path / "a.csv", "--calibration", file), INPUT_REFUSED, "edited.json", word, "outside")


@pytest.mark.long
@pytest.mark.parametrize("key, values", [
    ("readout_noise_rad", ("1e-9", "0.1")),
    ("drift_prior_sigma_rad_s", ("1e-15", "1e-2")),
    ("alignment_prior_sigma_rad", ("1e-9", "3.15")),
    ("noise_rad", ("[1e-9, 1e-9, 1e-9]", "[0.1, 0.1, 0.1]", "[1e-9, 0.1, 1e-9]")),
])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_ends_of_the_ranges_end_in_a_status(edited, tmp_path, key, values, estimator):
    for value in values:
        result = run("--quiet", "calibrate", edited(key, f"{key} = {value}"), "-o", tmp_path / "out", "--estimator", estimator)
        assert result.returncode in (TRUSTWORTHY, DO_NOT_USE, INPUT_REFUSED), (value, result.returncode, result.stderr)
        assert result.stderr.count("\n") == (1 if result.returncode == INPUT_REFUSED else 0)


@pytest.mark.parametrize("arguments, word", [
    (("evaluate", "p", "--attitude", "x", "--limit", "-5arcmin"), '--limit: "-5arcmin" is outside'),
    (("evaluate", "p", "--attitude", "x", "--limit", "400deg"), "outside 5.72958e-08 to 180.481 deg: an error has no sign"),
    (("observe", "s.toml", "--advise", "--slews", "0"), "is not a whole number from 1 to 100;"),
    (("observe", "s.toml", "--advise", "--slews", "-3"), "is not a whole number from 1 to 100;"),
    (("observe", "s.toml", "--advise", "--confirm", "10000000"), "is not a whole number from 1 to 1000000;"),
    (("replay", "p", "--spread-over", "-1"), "is not a whole number from 0 to 20;"),
    (("observe", "s.toml", "--advise", "--max-angle", "-1deg"), '--max-angle: "-1deg" is outside'),
    (("observe", "s.toml", "--advise", "--max-rate", "1e9deg/s"), "outside 5.72958e-05 to 57.2957 deg/s"),
    (("observe", "s.toml", "--advise", "--manoeuvre-time", "0s"), '--manoeuvre-time: "0s" is outside 1 to '),
    (("navigate", "p", "-o", "x", "--online", "--correction-interval", "100000d"), '--correction-interval: "100000d" is outside'),
    (("navigate", "p", "-o", "x", "--online", "--correction-interval", "never"), "or say none (only the first correction) or continuous (one at each fix)"),
    (("navigate", "p", "-o", "x", "--online", "--correction-interval", "90"), '--correction-interval: "90" is not a duration: the unit is missing'),
    (("navigate", "p", "-o", "x", "--online", "--need", "5arcmin"), "--need: "),
    (("replay", "p", "--spread-over", "21"), "is not a whole number from 0 to 20;"),
    (("replay", "p", "--required-error", "0arcsec"), '--required-error: "0arcsec" is outside'),
    (("replay", "p", "--required-interval", "0s"), '--required-interval: "0s" is outside 1 to 3.1e+07 s'),
    (("replay", "p", "--window", "0.1s"), "it is the stretch of the pass from which errors are predicted"),
    (("evaluate", "p", "--attitude", "x", "--limit", "5"), '--limit: "5" is not an angle: the unit is missing'),
    (("observe", "s.toml", "--advise", "--max-angle", "20"), '--max-angle: "20" is not an angle: the unit is missing'),
    (("observe", "s.toml", "--advise", "--max-rate", "5"), '--max-rate: "5" is not a rate: the unit is missing'),
])
def test_each_option_has_its_range(arguments, word):
    result = run(*arguments)
    refused(result, WRONG_USAGE, word)
    assert len(result.stderr) < 300


# Streams.


def shell(command, short_pass):
    """The command with $P as the program and $D as the pass; standard error is kept where the command does not say otherwise."""
    return subprocess.run(["bash", "-c", command], capture_output=True, text=True,
                          env={**os.environ, "P": str(PROGRAM), "D": str(short_pass)})


@pytest.mark.parametrize("command, status", [
    ("$P nonsense 2>&-", WRONG_USAGE),
    ("$P nonsense 2>/dev/full", WRONG_USAGE),
    ("$P inspect nowhere >&- 2>&-", INPUT_REFUSED),
    ("$P inspect $D 2>&-", TRUSTWORTHY),
    ("$P inspect $D 2>/dev/full", TRUSTWORTHY),
    ("$P inspect $D >&- 2>&-", MACHINE_FAILED),
    ("$P inspect $D <&- >&- 2>&-", MACHINE_FAILED),
    ("$P inspect $D >/dev/full 2>/dev/full", MACHINE_FAILED),
    ("$P --help >/dev/full 2>&-", MACHINE_FAILED),
    ("$P --quiet inspect $D <&- >&- 2>&-", TRUSTWORTHY),
])
def test_streams_that_cannot_be_written_end_in_a_status(short_pass, command, status):
    assert shell(command, short_pass).returncode == status


@pytest.mark.parametrize("where", [">&-", ">/dev/full"])
@pytest.mark.parametrize("arguments", ["inspect $D", "inspect $D --json", "--help", "--version"])
def test_a_standard_output_that_cannot_be_written_is_told(short_pass, arguments, where):
    result = shell(f"$P {arguments} {where}", short_pass)
    refused(result, MACHINE_FAILED, "standard output: cannot be written")


def test_files_do_not_get_the_numbers_of_closed_streams(short_pass, tmp_path):
    result = shell(f"cd {tmp_path} && $P calibrate $D -o out <&- >&- 2>&-", short_pass)
    assert result.returncode == MACHINE_FAILED
    expected = run("calibrate", short_pass, "-o", tmp_path / "expected")
    assert expected.returncode in (TRUSTWORTHY, DO_NOT_USE)
    for file in ("calibration.json", "attitude.csv", "effective-config.toml"):
        assert (tmp_path / "out" / file).read_bytes() == (tmp_path / "expected" / file).read_bytes()


# Memory.


def peak_mb(processors, *arguments):
    """Largest resident memory of a run on so many processors, so that it does not depend on how many the machine has."""
    chosen = set(sorted(os.sched_getaffinity(0))[:processors])
    process = subprocess.Popen([str(PROGRAM), "--quiet", *map(str, arguments)], preexec_fn=lambda: os.sched_setaffinity(0, chosen))
    _, status, usage = os.wait4(process.pid, 0)
    assert os.waitstatus_to_exitcode(status) in (TRUSTWORTHY, DO_NOT_USE)
    return usage.ru_maxrss / 1000


# Reader and estimator take their memory one after the other, and what the reader leaves is the same of either file.
@pytest.mark.long
@pytest.mark.parametrize("name, estimator", [("pass", "batch"), ("pass.nc", "invariant")])
def test_nine_hours_take_bounded_memory(tmp_path, name, estimator):
    nine_hours = simulated(tmp_path, name, '[scenario]\nduration = "9h"\n')
    assert peak_mb(2, "calibrate", nine_hours, "-o", tmp_path / "out", "--estimator", estimator) < 150


# On one processor: on two, fits are made side by side, and how many are in memory at the same time depends on what else the machine does.
# At 1 Hz, where there is least of the readings and most of all else.
@pytest.mark.long
def test_memory_is_linear_in_time(tmp_path):
    def peak(hours):
        scenario = f'[scenario]\nduration = "{hours}h"\n[gyro]\nperiod = "1s"\n'
        return peak_mb(1, "calibrate", simulated(tmp_path, "pass.nc", scenario), "-o", tmp_path / "out", "--estimator", "batch")

    two, four, eight = peak(2), peak(4), peak(8)
    assert eight - four < 2 * (four - two) * 1.3
