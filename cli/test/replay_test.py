"""A pass replayed through the on-board application: what it shows, that it can be killed at any moment and carried on, and that its attitude
is that of the other programs that fly the same. Run by CTest with TRIHEDRON_BUILD naming the build directory."""
import fcntl
import json
import os
import pty
import random
import re
import select
import signal
import struct
import subprocess
import termios
import time

import numpy
import pytest

from program import BUILD, DO_NOT_USE, INPUT_REFUSED, MACHINE_FAILED, PROGRAM, TOLD, TRUSTWORTHY, WRONG_USAGE, refused, run

# What is required of a calibration here, so that it is adopted within two hours.
SOON = ("--required-interval", "20min", "--window", "20min")


def simulated(directory, name, scenario):
    (directory / f"{name}.toml").write_text(scenario)
    result = run("--quiet", "simulate", directory / f"{name}.toml", "-o", directory / f"{name}.nc")
    assert result.returncode == TRUSTWORTHY, result.stderr
    return directory / f"{name}.nc"


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    directory = tmp_path_factory.mktemp("given")
    (directory / "told.toml").write_text(TOLD)
    return directory


@pytest.fixture(scope="module")
def two_hours(given):
    """With half as many samples as the paper has, which is half the work."""
    return simulated(given, "two_hours", '[scenario]\nseed = 5\nduration = "2h"\n[gyro]\nperiod = "250ms"\n'
                     '[gyro.drift]\noutside_sigma = "0rad/s"\n')


@pytest.fixture(scope="module")
def minutes(given):
    """Eight minutes with outliers, of a name that tries to steer the terminal."""
    return simulated(given, "minutes", '[scenario]\nspacecraft = "RE\\u001b[2JSURS"\nseed = 2\nduration = "8min"\n'
                     "[star_tracker]\noutlier_probability = 0.05\n")


@pytest.fixture(scope="module")
def whole(two_hours, tmp_path_factory):
    """What a replay of the two hours gives that nothing breaks off, and how long it takes."""
    out = tmp_path_factory.mktemp("whole")
    began = time.monotonic()
    result = run("--quiet", "replay", two_hours, "--speed", "max", *SOON, "-o", out / "attitude.csv", "--calibration",
                 out / "calibration.json", "--state", out / "state")
    assert result.returncode == TRUSTWORTHY, result.stderr
    return out, time.monotonic() - began


def until(holds, seconds=120):
    """Waits for something that a program brings about, however busy the machine is."""
    limit = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < limit
        time.sleep(0.005)


def snapshots_in(state):
    """The sequence number of the newest snapshot in the file: the bytes 8 to 15 of each half, least significant first."""
    content = state.read_bytes() if state.exists() else b""
    return max((int.from_bytes(slot[8:16], "little") for slot in (content[:len(content) // 2], content[len(content) // 2:])), default=0)


def attitude_of(path):
    return numpy.loadtxt(path, delimiter=",", skiprows=1)


# What it shows.


def test_lines_where_there_is_no_terminal(two_hours):
    result = run("replay", two_hours, "--speed", "max", *SOON)
    assert result.returncode == TRUSTWORTHY, result.stderr
    lines = result.stdout.splitlines()
    in_minutes = [line for line in lines if re.match(r" *[\d.]+ min  \w+.*, sigma .*fixes \d+ used \d+ rejected, call ", line)]
    assert 115 <= len(in_minutes) <= 121
    for word in ("mode aligning", "mode calibrating", "mode navigating", "calibration adopted: attitude within 5′"):
        assert any(word in line for line in lines), word
    assert "\x1b" not in result.stdout
    assert any(line.startswith("Verdict     trustworthy") for line in lines)
    assert any(re.match(r"Call        50 % [\d.]+ µs, 99 % .*, 99.9 % .*, longest ", line) for line in lines)


def test_rejections_are_told_once_a_run(minutes):
    result = run("replay", minutes, "--speed", "max")
    told = [line for line in result.stdout.splitlines() if "fix rejected: outlier" in line]
    counts = int(re.search(r"Fixes       \d+ used, (\d+) rejected", result.stdout).group(1))
    assert 1 <= len(told) <= counts
    assert result.returncode == DO_NOT_USE
    assert "not-adopted" in result.stdout and "nothing was predicted yet" in result.stdout
    assert "\x1b" not in result.stdout


def test_json_is_one_object_and_quiet_is_quiet(minutes, tmp_path):
    result = run("--json", "replay", minutes, "--speed", "max", "-o", tmp_path / "a.csv")
    told = json.loads(result.stdout)
    assert told["mode"] == "calibrating" and told["faults"] == [] and told["adoptions"] == 0
    assert told["attitudes"] == len(attitude_of(tmp_path / "a.csv"))
    assert [(its["code"], its["severity"]) for its in told["verdict"]["findings"]] == [("not-adopted", "do-not-use")]
    assert told["calls"]["count"] > 3800 and 0 < told["calls"]["p50_s"] <= told["calls"]["p99_s"] <= told["calls"]["longest_s"]
    assert run("--quiet", "replay", minutes, "--speed", "max").stdout == ""


def test_an_application_that_has_failed_is_not_to_be_used(tmp_path):
    """It navigates by the calibration from the first hour on; five minutes before the end the second gyro stands still."""
    (tmp_path / "scenario.toml").write_text('[scenario]\nseed = 5\nduration = "80min"\n[gyro]\nperiod = "250ms"\n[gyro.drift]\noutside_sigma = "0rad/s"\n')
    assert run("--quiet", "simulate", tmp_path / "scenario.toml", "-o", tmp_path / "pass").returncode == TRUSTWORTHY
    options = ("--speed", "max", *SOON)
    good = json.loads(run("--json", "replay", tmp_path / "pass", *options).stdout)
    assert good["verdict"]["trustworthy"] and good["samples_not_taken"] == 0
    assert good["samples_used"] + good["samples_thinned"] + good["samples_rejected"] == good["pass"]["gyro_samples"]
    assert good["fixes_used"] + good["fixes_rejected"] + good["fixes_not_taken"] == good["pass"]["fixes"]
    samples = tmp_path / "pass" / "gyro.csv"
    header, *lines = samples.read_text().splitlines()
    still = lines[-1200].split(",")[4:]
    samples.write_text("\n".join([header, *lines[:-1200], *(",".join(line.split(",")[:4] + still) for line in lines[-1200:])]) + "\n")
    result = run("--json", "replay", tmp_path / "pass", *options)
    assert result.returncode == DO_NOT_USE, result.stderr
    told = json.loads(result.stdout)
    assert told["mode"] == "failed" and told["adoptions"] == 1
    assert not told["verdict"]["trustworthy"]
    finding, = told["verdict"]["findings"]
    assert (finding["code"], finding["severity"]) == ("application-failed", "do-not-use")
    assert 75.9 < float(re.search(r"failed at ([\d.]+) min", finding["text"]).group(1)) < 76.2 and "gyro 2 stuck" in finding["evidence"]
    assert 900 < told["samples_not_taken"] < 970 and told["fixes_not_taken"] > 50
    result = run("replay", tmp_path / "pass", *options)
    assert result.returncode == DO_NOT_USE
    assert "DO NOT USE" in result.stdout and "application-failed" in result.stdout
    assert re.search(rf"^Not taken   {told['samples_not_taken']} samples, {told['fixes_not_taken']} fixes: it had failed$", result.stdout, re.MULTILINE)


def test_data_on_standard_output_leave_the_lines_to_standard_error(minutes, tmp_path):
    run("--quiet", "replay", minutes, "--speed", "max", "-o", tmp_path / "a.csv")
    piped = run("replay", minutes, "--speed", "max", "-o", "-")
    assert piped.stdout == (tmp_path / "a.csv").read_text()
    assert "mode aligning" in piped.stderr


class Terminal:
    """The program on a terminal of its own."""

    def __init__(self, *arguments, rows=40, columns=100, term="xterm", **environment):
        self.master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.process = subprocess.Popen([str(PROGRAM), *map(str, arguments)], stdin=slave, stdout=slave, stderr=slave,
                                        env={**os.environ, "TERM": term, **environment}, start_new_session=True)
        os.close(slave)
        self.shown = b""

    def read(self, awaited=None):
        """Until it ends, or shows what is awaited."""
        limit = time.monotonic() + 120
        while time.monotonic() < limit and (awaited is None or awaited not in self.shown):
            if select.select([self.master], [], [], 0.05)[0]:
                try:
                    self.shown += os.read(self.master, 65536)
                except OSError:
                    break

    def end(self):
        self.read()
        os.close(self.master)
        return self.process.wait(timeout=60)


def test_a_live_screen_in_a_terminal(minutes):
    began = time.monotonic()
    terminal = Terminal("replay", minutes, "--speed", "240", NO_COLOR="")
    assert terminal.end() == DO_NOT_USE
    took = time.monotonic() - began
    shown = terminal.shown.decode()
    assert shown.startswith("\x1b[?25l") and shown.count("\x1b[?25l") == 1
    assert shown.count("\x1b[?25h") == 1 and "Verdict" in shown.split("\x1b[?25h")[1]
    frames = re.split(r"\r\x1b\[\d+A", shown)
    assert 3 <= len(frames) <= 3 + 5.5 * took  # five a second
    for frame in frames[-2:]:
        for word in ("Mode        ", "Sigmas      ", "Readiness   ", "Call        50 %", "Late        50 %", "Rejections  ", "k0 ", "align_x"):
            assert word in frame, (word, frame)
    assert "rejected: outlier" in shown and "Mode        calibrating" in shown
    # The name cannot steer the terminal: nothing but what moves the cursor.
    assert "RE\\x1b[2JSURS" in shown
    assert set(re.findall(r"\x1b\[[\d;?]*[A-Za-z]", shown)) <= {"\x1b[?25l", "\x1b[?25h", "\x1b[K", "\x1b[J", "\x1b[1;31m", "\x1b[1;32m", "\x1b[0m",
                                                              *re.findall(r"\x1b\[\d+A", shown)}


def test_a_screen_fits_its_terminal(minutes):
    terminal = Terminal("replay", minutes, "--speed", "480", rows=12, columns=40)
    terminal.end()
    screen = terminal.shown.decode().split("\x1b[?25h")[0]
    for frame in re.split(r"\r\x1b\[\d+A", screen)[1:]:
        lines = re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", frame).replace("\r", "").rstrip("\n").split("\n")
        assert len(lines) <= 11 and max(map(len, lines)) < 40


def test_a_screen_of_80_columns_shows_whole_lines(minutes):
    terminal = Terminal("replay", minutes, "--speed", "480", columns=300)
    terminal.end()
    screen = terminal.shown.decode().split("\x1b[?25h")[0]
    lines = re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", screen).replace("\r", "").split("\n")
    assert any("; adoptions " in line for line in lines) and max(map(len, lines)) < 80, max(lines, key=len)


@pytest.mark.long
def test_no_colour_and_a_dumb_terminal(two_hours, minutes):
    arguments = ("replay", two_hours, "--speed", "max", *SOON)
    for environment, is_coloured in (({}, True), ({"NO_COLOR": "1"}, False)):
        os.environ.pop("NO_COLOR", None)
        terminal = Terminal(*arguments, **environment)
        terminal.end()
        assert ("\x1b[1;32m" in terminal.shown.decode()) == is_coloured
    dumb = Terminal("replay", minutes, "--speed", "max", term="dumb")
    dumb.end()
    assert b"\x1b" not in dumb.shown and b" min  mode aligning" in dumb.shown


@pytest.mark.parametrize("with_signal", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_gives_the_cursor_back(minutes, with_signal):
    terminal = Terminal("replay", minutes, "--speed", "1")
    terminal.read(awaited=b"Mode  ")
    terminal.process.send_signal(with_signal)
    assert terminal.end() == -with_signal  # not after the eight minutes, for which a terminal does not wait
    assert terminal.shown.endswith(b"\x1b[?25h")


# By the clock.


def test_it_takes_as_long_as_the_speed_says(minutes):
    began = time.monotonic()
    result = run("--json", "replay", minutes, "--speed", "240")
    took = time.monotonic() - began
    assert took > 1.9
    assert json.loads(result.stdout)["late"]["count"] > 3800


@pytest.mark.parametrize("speed", ["0", "-1", "fast", "nan", "inf", "", "1x", "MAX", "1e30"])
def test_a_bad_speed_is_refused(minutes, speed):
    refused(run("replay", minutes, f"--speed={speed}"), WRONG_USAGE, "--speed", "max")


def test_other_options_that_make_no_sense_are_refused(minutes, tmp_path):
    refused(run("replay", minutes, "--resume"), WRONG_USAGE, "--state")
    refused(run("replay", minutes, "--state", tmp_path / "s", "-o", "-"), WRONG_USAGE, "standard output")
    refused(run("replay", minutes, "--required-error", "5"), WRONG_USAGE, "unit")
    refused(run("replay", minutes, "--required-error", "0arcmin"), WRONG_USAGE, "outside")
    refused(run("replay", minutes, "--window", "0min"), WRONG_USAGE, "outside")
    for files in (("-o", minutes), ("--state", minutes), ("--calibration", minutes), ("-o", tmp_path / "x", "--state", tmp_path / "x"),
                  ("--calibration", tmp_path / "x", "--state", tmp_path / "x")):
        refused(run("replay", minutes, "--speed", "max", *files), WRONG_USAGE, "output")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "settings.toml").write_text('drift_model = "esg20"\n')
    refused(run("replay", minutes, "--config", tmp_path / "settings.toml"), INPUT_REFUSED, "esg7")


# Killed and carried on.


@pytest.mark.long
def test_killed_at_any_moment_it_ends_as_if_nothing_had_been(two_hours, whole, tmp_path):
    expected, takes_s = whole
    attitude = (expected / "attitude.csv").read_bytes()
    moments = random.Random(11)
    kills = hits = went_on = 0
    for attempt in range(8):
        out = tmp_path / str(attempt)
        out.mkdir()
        files = ["-o", str(out / "attitude.csv"), "--calibration", str(out / "calibration.json"), "--state", str(out / "state"), "--resume"]
        # Ten seconds are longer than the machine needs for a snapshot or two; at greatest speed it may end first.
        for speed, snapshots in (("720", moments.choice((0, 1, 2))), ("720", 2), ("max", 0)):
            before = snapshots_in(out / "state")
            process = subprocess.Popen([str(PROGRAM), "--quiet", "replay", str(two_hours), "--speed", speed, *SOON, *files])
            until(lambda: process.poll() is not None or snapshots_in(out / "state") >= before + snapshots)
            time.sleep(moments.uniform(0, 0.7 * takes_s if speed == "max" else 0.3))
            process.kill()
            kills += 1
            hits += process.wait() == -signal.SIGKILL
            written = (out / "attitude.csv").read_bytes() if (out / "attitude.csv").exists() else b""
            assert attitude.startswith(written)
        result = run("--json", "replay", two_hours, "--speed", "max", *SOON, *files)
        assert result.returncode == TRUSTWORTHY, result.stderr
        # What was confirmed is no more than what was written, and is not made again.
        told = json.loads(result.stdout)
        went_on += told.get("resumed_s", 0) > 0
        assert told["attitudes"] == attitude.count(b"\n") - 1
        for name in ("attitude.csv", "calibration.json"):
            assert (out / name).read_bytes() == (expected / name).read_bytes(), (attempt, name)
    assert kills >= 20 and hits >= 14 and went_on >= 6


def test_a_signal_confirms_all_that_there_is(two_hours, whole, tmp_path):
    expected, _ = whole
    arguments = ("--quiet", "replay", two_hours, "--speed", "max", *SOON, "-o", tmp_path / "a.csv", "--calibration", tmp_path / "c.json", "--state",
                 tmp_path / "state")
    slowly = ["720" if its == "max" else its for its in arguments]
    process = subprocess.Popen([str(PROGRAM), *map(str, slowly)])
    until(lambda: snapshots_in(tmp_path / "state") >= 4)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=10) == -signal.SIGTERM
    written = (tmp_path / "a.csv").read_bytes()
    assert written.endswith(b"\n") and (expected / "attitude.csv").read_bytes().startswith(written)
    refused(run(*arguments), WRONG_USAGE, "--resume")
    assert (tmp_path / "a.csv").read_bytes() == written
    result = run("--json", *arguments[1:], "--resume")
    assert result.returncode == TRUSTWORTHY, result.stderr
    # It goes on from the last line.
    assert abs(json.loads(result.stdout)["resumed_s"] - float(written.splitlines()[-1].split(b",")[0])) < 0.2
    assert (tmp_path / "a.csv").read_bytes() == (expected / "attitude.csv").read_bytes()
    assert (tmp_path / "c.json").read_bytes() == (expected / "calibration.json").read_bytes()
    # Once more: all is done already.
    again = run("--json", *arguments[1:], "--resume")
    assert json.loads(again.stdout)["calls"]["count"] == 0
    assert (tmp_path / "c.json").read_bytes() == (expected / "calibration.json").read_bytes()


@pytest.fixture
def broken_off(minutes, tmp_path):
    """A replay that was stopped half-way, and the arguments that carry it on."""
    arguments = ("--quiet", "replay", minutes, "--speed", "60", "-o", tmp_path / "a.csv", "--state", tmp_path / "state")
    process = subprocess.Popen([str(PROGRAM), *map(str, arguments)])
    until(lambda: snapshots_in(tmp_path / "state") >= 5)
    process.kill()
    process.wait()
    return tmp_path, (*("max" if its == "60" else its for its in arguments), "--resume")


def test_a_torn_slot_leaves_the_other(broken_off):
    directory, arguments = broken_off
    state = bytearray((directory / "state").read_bytes())
    half = len(state) // 2
    newest = 0 if state[8:16] > state[half + 8:half + 16] else half  # sequence numbers below 256
    state[newest + 4000] ^= 1
    (directory / "state").write_bytes(state)
    result = run("--verbose", *arguments[1:])
    assert result.returncode == DO_NOT_USE, result.stderr
    assert "torn or damaged" in result.stderr
    run("--quiet", "replay", arguments[2], "--speed", "max", "-o", directory / "whole.csv")
    assert (directory / "a.csv").read_bytes() == (directory / "whole.csv").read_bytes()


@pytest.mark.parametrize(("spoil", "words"), [
    (lambda state: state[:3000], ("too short",)),
    (lambda state: b"", ("too short",)),
    (lambda state: bytes(len(state)), ("none of this program",)),
    (lambda state: bytes(len(state) - 4) + b"text", ("none of this program",)),
    (lambda state: bytes(byte ^ (i % 5000 == 4999) for i, byte in enumerate(state)), ("torn or damaged",)),
])
def test_a_state_that_is_none_is_refused(broken_off, spoil, words):
    directory, arguments = broken_off
    (directory / "state").write_bytes(spoil((directory / "state").read_bytes()))
    before = (directory / "a.csv").read_bytes()
    refused(run(*arguments), INPUT_REFUSED, "state", *words)
    assert (directory / "a.csv").read_bytes() == before


def test_a_state_goes_with_its_pass_its_settings_and_its_attitude(broken_off, two_hours):
    directory, arguments = broken_off
    other_pass = [two_hours if its == arguments[2] else its for its in arguments]
    refused(run(*other_pass), INPUT_REFUSED, "another pass")
    refused(run(*arguments, "--window", "20min"), INPUT_REFUSED, "other settings")
    refused(run(*arguments, "--correction-interval", "90min"), INPUT_REFUSED, "other settings")
    refused(run(*(its for its in arguments if its not in ("-o", directory / "a.csv"))), INPUT_REFUSED, "file of attitude")
    attitude = (directory / "a.csv").read_bytes()
    for changed, words in ((attitude[:200], "confirmed"), (attitude.replace(b"t_s", b"T_s"), "confirmed")):
        (directory / "a.csv").write_bytes(changed)
        refused(run(*arguments), INPUT_REFUSED, words)
        assert (directory / "a.csv").read_bytes() == changed
    (directory / "a.csv").write_bytes(attitude)
    assert run(*arguments).returncode == DO_NOT_USE


@pytest.mark.parametrize("output", ["--calibration", "--state", "--records"])
def test_only_the_attitude_goes_to_standard_output(minutes, tmp_path, output):
    refused(run("replay", minutes, "--speed", "max", output, "-", cwd=tmp_path), WRONG_USAGE, "standard output")
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_no_state_is_not_replaced(minutes, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    refused(run("replay", minutes, "--speed", "max", "--state", tmp_path / "notes.txt"), WRONG_USAGE, "no state")
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_state_is_of_one_replay_at_a_time(minutes, tmp_path):
    arguments = ("--quiet", "replay", minutes, "--state", tmp_path / "state", "--resume")
    process = subprocess.Popen([str(PROGRAM), *map(str, arguments)])
    until(lambda: snapshots_in(tmp_path / "state") >= 2)
    refused(run(*arguments), MACHINE_FAILED, "another program")
    process.kill()
    process.wait()


# The same attitude as of others.


@pytest.mark.long
def test_it_is_navigate_with_the_prior_until_the_adoption_and_online_from_then_on(given, two_hours):
    result = run("--quiet", "replay", two_hours, "--speed", "max", *SOON, "--spread-over", "0", "-o", given / "replay.csv")
    assert result.returncode == TRUSTWORTHY, result.stderr
    told = ("--config", given / "told.toml", "--correction-interval", "continuous")
    for source in ("prior", "online"):
        result = run("--quiet", "navigate", two_hours, f"--{source}", *told, "-o", given / f"{source}.csv")
        assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    lines = {name: path.read_text().splitlines()[1:] for name, path in (
        ("replay", given / "replay.csv"), ("prior", given / "prior.csv"), ("online", given / "online.csv"))}
    assert len(lines["replay"]) == len(lines["prior"]) == len(lines["online"]) > 28500
    as_prior = [a == b for a, b in zip(lines["replay"], lines["prior"])]
    as_online = [a == b for a, b in zip(lines["replay"], lines["online"])]
    adopted = as_prior.index(False)
    # At once from the one to the other, and not back.
    assert all(as_online[adopted:]) and not any(as_prior[adopted:])
    assert 20 * 60 < float(lines["replay"][adopted].split(",")[0]) < 100 * 60


@pytest.mark.long
def test_it_is_the_example_in_c(two_hours, whole, tmp_path):
    result = run("--quiet", "replay", two_hours, "--speed", "max", *SOON, "--records", tmp_path / "records")
    assert result.returncode == TRUSTWORTHY, result.stderr
    example = BUILD / "replayed"
    assert subprocess.run([example, tmp_path / "records", tmp_path / "attitudes"]).returncode == 0
    attitudes = numpy.fromfile(tmp_path / "attitudes", dtype=[("time_ns", "i8"), ("q", "f8", 4), ("covariance", "f8", (3, 3))])
    lines = (whole[0] / "attitude.csv").read_text().splitlines()[1:]
    assert len(attitudes) == len(lines) > 28500
    sigmas = numpy.sqrt(numpy.einsum("nii->ni", attitudes["covariance"]))
    for line, q, sigma in zip(lines, attitudes["q"], sigmas):
        assert line.split(",")[1:8] == [*(f"{its:.12f}" for its in q), *(f"{its:.6e}" for its in sigma)]
    # It is no example of a file that is damaged.
    records = (tmp_path / "records").read_bytes()
    for damaged in (b"", records[:-1], records[8:], records[:4136] + records[:8]):
        (tmp_path / "damaged").write_bytes(damaged)
        assert subprocess.run([example, tmp_path / "damaged", tmp_path / "none"], capture_output=True).returncode == 3
    assert subprocess.run([example], capture_output=True).returncode == 2
    assert subprocess.run([example, tmp_path / "records", tmp_path / "none" / "a"], capture_output=True).returncode == 4


def test_a_pass_without_a_usable_fix_gives_no_attitude(tmp_path):
    blind = simulated(tmp_path, "blind", """
[scenario]
duration = "4min"
[gyro]
gaps = [{begin = "30s", end = "210s"}]
[star_tracker]
outages = [{begin = "0s", end = "40s"}, {begin = "200s", end = "5min"}]
""")
    result = run("replay", blind, "--speed", "max", "-o", tmp_path / "a.csv", "--calibration", tmp_path / "c.json")
    assert result.returncode == DO_NOT_USE, result.stderr
    assert "Mode        waiting for a fix" in result.stdout or "Mode        failed" in result.stdout
    assert "not-adopted" in result.stdout and "no fix could be used" in result.stdout
    assert (tmp_path / "a.csv").read_text().count("\n") == 1 and not (tmp_path / "c.json").exists()
