"""What the program says, and how it can be asked: suggestions, numbers, names, help, streams, log. Run by CTest with TRIHEDRON_BUILD naming the
build directory."""
import json
import os
import pty
import re
import shutil
import subprocess

import pytest

from program import DO_NOT_USE, INPUT_REFUSED, MACHINE_FAILED, PROGRAM, ROOT, TOLD, TRUSTWORTHY, WRONG_USAGE, refused, run

COMMANDS = ["simulate", "inspect", "calibrate", "navigate", "replay", "evaluate", "observe", "campaign", "history", "export", "import",
            "demo", "schema", "man", "completion"]

SCENARIO = """
[scenario]
seed = 5
duration = "8min"
[gyro.drift]
outside_sigma = "0rad/s"
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    directory = tmp_path_factory.mktemp("flown")
    assert run("--quiet", "simulate", "-", "-o", directory / "pass", input=SCENARIO).returncode == TRUSTWORTHY
    (directory / "told.toml").write_text(TOLD)
    return directory


def with_scenario(directory, name, text):
    result = run("--quiet", "simulate", "-", "-o", directory / name, input=text)
    assert result.returncode == TRUSTWORTHY, result.stderr
    return directory / name


# Wrong words.


@pytest.mark.parametrize("arguments, meant", [
    (("calibrat", "p"), "did you mean calibrate?"),
    (("evalute",), "did you mean evaluate?"),
    (("--quit", "inspect", "p"), "did you mean --quiet?"),
    (("calibrate", "p", "-o", "x", "--estimatr", "paper"), "did you mean --estimator?"),
    (("calibrate", "p", "-o", "x", "--estimator", "papr"), "did you mean paper?"),
    (("navigate", "p", "-o", "x", "--onlin"), "did you mean --online?"),
    (("observe", "p", "--max-angl=3deg"), "did you mean --max-angle?"),
    (("--log-file", "x", "histroy", "c.db"), "did you mean history?"),
    (("xyzzyxyzzy",), "there is no xyzzyxyzzy;"),
    (("plan", "s.toml"), "observe SCENARIO.toml --advise looks for slews"),
    (("schema", "scenari"), "scenario"),
])
def test_the_nearest_word_is_suggested(arguments, meant, tmp_path):
    result = run(*arguments, cwd=tmp_path)
    assert result.returncode == WRONG_USAGE
    assert meant in result.stderr and result.stderr.count("\n") == 1, result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("value", ["0", "-1", "1.5", "many", "1e9", ""])
def test_a_number_of_slews_is_told_in_few_digits(value, tmp_path):
    result = run("observe", "s.toml", "--advise", f"--slews={value}", cwd=tmp_path)
    assert result.returncode == WRONG_USAGE
    assert "--slews" in result.stderr and len(result.stderr) < 120, result.stderr


# Numbers that are none.

NONE = re.compile(r"(?<![a-z])(nan|inf)(?![a-z])", re.IGNORECASE)


@pytest.mark.parametrize("scenario", [
    SCENARIO + "[star_tracker]\noutlier_probability = 1\n",
    SCENARIO + '[star_tracker]\noutages = [{begin = "30s", end = "8min"}]\n',
    SCENARIO.replace("8min", "61s"),
], ids=["every fix wrong", "hardly any fix", "a minute"])
def test_a_number_that_is_none_is_said_in_words(flown, tmp_path, scenario):
    poor = with_scenario(tmp_path, "poor", scenario)
    calibrations = [("calibrate", poor, "-o", tmp_path / estimator, "--estimator", estimator) for estimator in ("invariant", "paper", "batch")]
    for arguments in (*calibrations, ("observe", poor), ("navigate", poor, "--online", "-o", tmp_path / "a.csv"),
                      ("evaluate", poor, "--attitude", tmp_path / "a.csv")):
        told = () if arguments[0] == "evaluate" else ("--config", flown / "told.toml")
        result = run(*arguments, *told)
        assert result.returncode in (TRUSTWORTHY, DO_NOT_USE, INPUT_REFUSED), result.stderr
        assert not NONE.search(result.stdout + result.stderr), result.stdout + result.stderr
        as_json = run("--json", *arguments, *told)
        if as_json.returncode != INPUT_REFUSED:
            json.loads(as_json.stdout, parse_constant=pytest.fail)  # no NaN, no Infinity
    for report in tmp_path.glob("*/report.html"):
        tables = re.sub(r"<script.*?</script>|<style.*?</style>", "", report.read_text(), flags=re.DOTALL)
        assert not NONE.search(re.sub(r"<[^>]*>", " ", tables))


# Names.


def test_a_name_cannot_steer_the_terminal(flown, tmp_path):
    evil = with_scenario(tmp_path, "evil", SCENARIO.replace("[scenario]", '[scenario]\nspacecraft = "\\u001b[31mRED\\u009b2J\\u202e"'))
    (tmp_path / "out\x1b[2J").mkdir()
    result = run("calibrate", evil, "-o", tmp_path / "out\x1b[2J", "--config", flown / "told.toml", "--estimator", "paper", "--verbose",
                 "--log-file", tmp_path / "log")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    printed = result.stdout + result.stderr + (tmp_path / "log").read_text()
    assert "\\x1b[31mRED\\u{9b}2J\\u{202e}" in result.stdout and "\\x1b[2J" in result.stdout
    for control in "\x1b\x9b\u202e":
        assert control not in printed
        assert control not in (tmp_path / "out\x1b[2J" / "report.html").read_text()
    as_json = run("--json", "inspect", evil)
    assert json.loads(as_json.stdout)["spacecraft"] == "\x1b[31mRED\x9b2J\u202e"
    assert "\x1b" not in as_json.stdout and "\x9b" not in as_json.stdout


def test_a_key_and_a_missing_file_cannot_steer_the_terminal(tmp_path):
    result = run("simulate", "-", "-o", tmp_path / "p", input='"\\u001b[31mkey" = 1\n')
    assert result.returncode == INPUT_REFUSED and "\\x1b[31mkey" in result.stderr and "\x1b" not in result.stderr
    result = run("inspect", tmp_path / "no\x1b[31m\nsuch")
    assert result.returncode == INPUT_REFUSED and "no\\x1b[31m\\x0asuch" in result.stderr and "\x1b" not in result.stderr
    result = run("\x1b[31m")
    assert result.returncode == WRONG_USAGE and "\x1b" not in result.stderr


def test_a_name_that_is_no_utf8_is_shown(flown, tmp_path):
    odd = os.fsencode(tmp_path) + b"/p\xff\xfess"
    shutil.copytree(os.fsencode(flown / "pass"), odd)
    two = [os.fsencode(PROGRAM), b"--json", b"calibrate", odd, b"-o", os.fsencode(tmp_path / "out"), b"--estimator", b"paper", b"--config",
           os.fsencode(flown / "told.toml"), b"--catalogue", os.fsencode(tmp_path / "c.db")]
    result = subprocess.run(two, capture_output=True)
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    json.loads(result.stdout.decode())
    (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for arguments in (("history", tmp_path / "c.db", "-o", tmp_path / "h.html"), ("--json", "history", tmp_path / "c.db")):
        result = run(*arguments, text=False)
        assert result.returncode == TRUSTWORTHY, result.stderr
        result.stdout.decode()
    (tmp_path / "h.html").read_text(encoding="utf-8")
    refused = subprocess.run([os.fsencode(PROGRAM), b"inspect", odd + b"\x80"], capture_output=True)
    assert refused.returncode == INPUT_REFUSED and b"p\\xff\\xfess\\x80" in refused.stderr


# Help and what is made like it.


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_help_says_what_people_look_for(command):
    result = run(*([command] if command else []), "--help")
    assert (result.returncode, result.stderr) == (TRUSTWORTHY, "")
    assert all(len(line) <= 100 for line in result.stdout.splitlines()), max(result.stdout.splitlines(), key=len)
    for words in ("usage: trihedron", "Exit status\n  0  done", "Examples\n", "--log-file FILE", "--help"):
        assert words in result.stdout
    for example in re.findall(r"^  trihedron (?:--\w+ )?(\w+)", result.stdout.split("Examples")[1], re.MULTILINE):
        assert example in COMMANDS


def test_help_names_values_and_defaults():
    text = run("calibrate", "--help").stdout
    assert "invariant|paper|batch" in text and "auto|field|esg7|esg20|vsh:1" in text and "(required)" in text
    assert "[default: 5arcmin]" in run("evaluate", "--help").stdout
    assert "[default: 30deg]" in run("observe", "--help").stdout
    assert run("navigate", "--help").stdout.count("--help") == 1


def test_the_manual_of_commands_is_as_the_program_says():
    assert run("man", "--markdown").stdout == (ROOT / "docs" / "commands.md").read_text(), \
        "build/trihedron man --markdown > docs/commands.md"


def test_the_manual_page_has_every_command_and_option():
    page = run("man").stdout
    assert page.startswith('.TH TRIHEDRON 1')
    for command in COMMANDS:
        assert f".SS {command}\n" in page
    for option in set(re.findall(r"^  (?:-\w, )?(--[\w-]+)", run("calibrate", "--help").stdout, re.MULTILINE)):
        assert option.replace("-", "\\-") in page
    assert not re.search(r"^['.](?!TH|ad l|SH|SS|TP|B |BR |I |PP|nf|fi)", page, re.MULTILINE)


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_a_manual_page_with_its_options(command):
    page = run("man", command).stdout
    assert page.startswith(f".TH TRIHEDRON\\-{command.upper()} 1 ")
    assert f".SH NAME\ntrihedron\\-{command} \\- " in page and ".SH EXIT STATUS\n" in page
    for option in set(re.findall(r"^  (?:-\w, )?(--[\w-]+)", run(command, "--help").stdout, re.MULTILINE)):
        assert option.replace("-", "\\-") in page, option
    assert not re.search(r"^['.](?!TH|ad l|SH|TP|B |BR |I |PP|nf|fi)", page, re.MULTILINE)


def test_a_manual_page_of_no_command_is_refused():
    refused(run("man", "calibrat"), WRONG_USAGE, "there is no command calibrat")
    refused(run("man", "calibrate", "--markdown"), WRONG_USAGE, "leave out COMMAND")


@pytest.mark.skipif(not shutil.which("man"), reason="no man here")
@pytest.mark.parametrize("command", [(), ("calibrate",), ("schema",)])
def test_manual_pages_are_set_without_a_warning(command, tmp_path):
    page = tmp_path / "page.1"
    page.write_text(run("man", *command).stdout)
    result = subprocess.run(["man", "--warnings=all", "--local-file", page], capture_output=True, text=True,
                            env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "80", "MANROFFOPT": ""})
    assert result.returncode == 0 and result.stderr == "", result.stderr


def completed(*words):
    """What bash offers for the last of the words."""
    script = 'eval "$("$0" completion bash)"; COMP_WORDS=(trihedron "$@"); COMP_CWORD=$#; _trihedron; printf "%s\\n" "${COMPREPLY[@]}"'
    result = subprocess.run(["bash", "-c", script, str(PROGRAM), *words], capture_output=True, text=True)
    return result.stdout.split()


def test_bash_completes_commands_options_and_their_words():
    assert completed("cal") == ["calibrate"]
    assert set(completed("")) == set(COMMANDS)
    assert completed("calibrate", "--esti") == ["--estimator"]
    assert completed("calibrate", "--estimator", "") == ["invariant", "paper", "batch"]
    assert "continuous" in completed("navigate", "p", "--correction-interval", "")
    assert "history-output" in completed("schema", "hist")
    assert completed("man", "cal") == ["calibrate"]
    assert completed("completion", "z") == ["zsh"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_a_script_of_that_shell(shell):
    script = run("completion", shell).stdout
    for words in (*COMMANDS, "estimator", "log-file"):
        assert words in script
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=script, text=True, check=True)
    assert run("completion", "tcsh").returncode == WRONG_USAGE


# Settings, streams, log, colours.

ALL_SETTINGS = """
estimator = "batch"
drift_model = "vsh:2"
[filter]
noise = "told"
direction_random_walk = "0.002deg/h^0.5"
gate_nis = 41.5
student_t_freedom = 7
reopen_after_rejections = 31
reopen_after_jump_rejections = 333
angles_after = "never"
[further_states]
clock_offset = "on"
clock_rate = "off"
orbital_error = "off"
readout_bias = "on"
coefficient_change = "off"
wandering_drift = "3e-09rad/s"
wandering_time = "47min"
change_course = "warm-up"
change_time = "83min"
[corrections]
interval = "continuous"
"""


@pytest.mark.parametrize("command", ["calibrate", "navigate", "observe"])
@pytest.mark.parametrize("settings", ["", ALL_SETTINGS], ids=["defaults", "all set"])
def test_settings_that_are_printed_come_back(command, settings):
    printed = run(command, "--print-config", "--config", "-", input=settings)
    assert (printed.returncode, printed.stderr) == (TRUSTWORTHY, "")
    assert run(command, "--print-config", "--config", "-", input=printed.stdout).stdout == printed.stdout
    for line in settings.split("\n"):
        if " = " in line and "deg/h" not in line:
            assert line in printed.stdout


def test_settings_that_are_printed_have_the_options():
    printed = run("calibrate", "--estimator", "paper", "--drift-model", "esg20", "--print-config").stdout
    assert 'estimator = "paper"' in printed and 'drift_model = "esg20"' in printed
    assert 'interval = "30min"' in run("navigate", "p", "--print-config", "--correction-interval", "30min").stdout
    result = run("calibrate", "--print-config", "--config", "-", input="gate = 3\n")
    assert result.returncode == INPUT_REFUSED and "/dev/stdin:1:1" in result.stderr


def test_data_goes_through_standard_streams(flown, tmp_path):
    told = ("--config", flown / "told.toml")
    to_file = run("navigate", flown / "pass", "--prior", "-o", tmp_path / "a.csv", *told)
    piped = run("navigate", flown / "pass", "--prior", "-o", "-", *told)
    assert piped.returncode == to_file.returncode
    assert piped.stdout == (tmp_path / "a.csv").read_text()
    assert "Attitude error" in piped.stderr
    evaluated = [run("--json", "evaluate", flown / "pass", "--attitude", name, input=piped.stdout) for name in ("-", tmp_path / "a.csv")]
    assert evaluated[0].returncode == TRUSTWORTHY and evaluated[0].stdout == evaluated[1].stdout
    with open(tmp_path / "a.csv") as file:
        assert run("--json", "evaluate", flown / "pass", "--attitude", "-", stdin=file).stdout == evaluated[0].stdout
    cut = run("evaluate", flown / "pass", "--attitude", "-", input=piped.stdout[:1000])
    assert cut.returncode == INPUT_REFUSED and "/dev/stdin" in cut.stderr


def test_the_log_says_what_was_decided(flown, tmp_path):
    log = tmp_path / "log"
    result = run("--verbose", "--log-file", log, "calibrate", flown / "pass", "-o", tmp_path / "out", "--config", flown / "told.toml")
    lines = log.read_text().splitlines()
    assert all(re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}[+-]\d\d:\d\d \S", line) for line in lines)
    said = [line.split(" ", 1)[1] for line in lines]
    assert result.stderr.splitlines() == [f"trihedron: {line}" for line in said]
    for words in ("read ", "estimator = ", "drift model esg7 is used", "verdict: ", "written ", f"exit status {result.returncode}"):
        assert any(line.startswith(words) for line in said), words
    quiet = run("--quiet", "--log-file", log, "inspect", flown / "pass")
    assert (quiet.stdout, quiet.stderr) == ("", "") and len(log.read_text().splitlines()) > len(lines)
    nowhere = run("--log-file", "/proc/nowhere/log", "inspect", flown / "pass")
    assert nowhere.returncode == MACHINE_FAILED and "/proc/nowhere/log" in nowhere.stderr and nowhere.stderr.count("\n") == 1
    full = run("--log-file", "/dev/full", "inspect", flown / "pass")
    assert full.returncode == MACHINE_FAILED and "/dev/full" in full.stderr, full.stderr


def test_the_log_spoils_no_file(flown, tmp_path):
    for name in ("gyro.csv", "pass.toml"):
        before = (flown / "pass" / name).read_bytes()
        result = run("--log-file", flown / "pass" / name, "inspect", flown / "pass")
        assert result.returncode == WRONG_USAGE and "no log of trihedron" in result.stderr and result.stderr.count("\n") == 1
        assert (flown / "pass" / name).read_bytes() == before
    (tmp_path / "empty").touch()
    assert run("--log-file", tmp_path / "empty", "inspect", flown / "pass").returncode == TRUSTWORTHY


def on_terminal(*arguments, **environment):
    ours, theirs = pty.openpty()
    process = subprocess.Popen([str(PROGRAM), *map(str, arguments)], stdout=theirs, stderr=subprocess.DEVNULL,
                               env={**{k: v for k, v in os.environ.items() if k != "NO_COLOR"}, "TERM": "xterm", **environment})
    os.close(theirs)
    text = b""
    try:
        while chunk := os.read(ours, 65536):
            text += chunk
    except OSError:  # the other end is closed
        pass
    process.wait()
    os.close(ours)
    return text.decode()


def test_only_a_terminal_gets_colours_and_not_against_its_will(flown, tmp_path):
    arguments = ("navigate", flown / "pass", "--prior", "-o", tmp_path / "a.csv", "--config", flown / "told.toml")
    assert "\x1b[1;3" in on_terminal(*arguments)
    assert "\x1b" not in on_terminal(*arguments, NO_COLOR="1")
    assert "\x1b" not in on_terminal(*arguments, TERM="dumb")
    assert "\x1b" not in run(*arguments).stdout
