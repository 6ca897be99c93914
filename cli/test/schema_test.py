"""JSON schemas of every file and output, by a validator that knows nothing of this program. Run by CTest with TRIHEDRON_BUILD naming the build
directory."""
import copy
import datetime
import functools
import json
import re
import shutil
import tomllib

import jsonschema
import pytest

from program import DO_NOT_USE, INPUT_REFUSED, MACHINE_FAILED, ROOT, TOLD, TRUSTWORTHY, WRONG_USAGE, run


@functools.cache
def schema(name):
    """Not to be changed: all who ask get the same."""
    result = run("schema", name)
    assert result.returncode == TRUSTWORTHY, result.stderr
    return json.loads(result.stdout)


NAMES = run("schema").stdout.split()


def is_valid(document, name):
    return jsonschema.Draft202012Validator(schema(name)).is_valid(document)


def check(document, name, only_described=False):
    described = schema(name)
    if only_described:  # what may be added by a newer program is not added by this one
        described = copy.deepcopy(described)
        close(described)
    jsonschema.validate(document, described, jsonschema.Draft202012Validator)


def close(part):
    if isinstance(part, dict):
        if part.get("properties") and part.get("additionalProperties") is True:
            part["additionalProperties"] = False
        for inner in part.values():
            close(inner)
    elif isinstance(part, list):
        for inner in part:
            close(inner)


def plain(value):
    """TOML as JSON has it."""
    if isinstance(value, dict):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [plain(inner) for inner in value]
    return value.isoformat() if isinstance(value, datetime.datetime) else value


def toml(text):
    return plain(tomllib.loads(text))


# So long that outputs have all that they can have; with half as many samples as the paper has, which is half the work.
SCENARIO = """
[scenario]
seed = 3
duration = "100min"
[gyro]
period = "250ms"
[gyro.drift]
outside_sigma = "0rad/s"
[[gyro.unit]]
start_direction_c = [0.995, 0.087, 0.045]
alignment_prior_sigma = "20arcmin"
[[gyro.unit]]
start_direction_c = [0.14, 0.985, 0.094]
[[star_tracker.further]]
mounting_rotation_vector = ["0deg", "60deg", "0deg"]
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A pass as a directory, its calibration, an attitude, a catalogue."""
    directory = tmp_path_factory.mktemp("flown")
    (directory / "scenario.toml").write_text(SCENARIO)
    (directory / "told.toml").write_text(TOLD)
    assert run("--quiet", "simulate", directory / "scenario.toml", "-o", directory / "pass").returncode == TRUSTWORTHY
    return directory


@pytest.fixture(scope="module")
def calibrated(flown):
    result = run("--json", "calibrate", flown / "pass", "-o", flown / "out", "--config", flown / "told.toml", "--catalogue", flown / "c.db")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    return flown, json.loads(result.stdout)


@pytest.mark.parametrize("name", NAMES)
def test_schemas_are_schemas(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    assert schema(name)["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def test_every_file_and_output_has_one():
    assert NAMES == ["pass", "telemetry", "config", "scenario", "campaign", "calibration", "truth", "inspect-output", "calibrate-output", "navigate-output",
                     "replay-output", "evaluate-output", "observe-output", "history-output", "export-output", "import-output",
                     "campaign-output", "campaign-run-output"]
    result = run("schema", "scenari")
    assert result.returncode == WRONG_USAGE and "scenario" in result.stderr


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.stem)
def test_examples_are_scenarios(path):
    check(toml(path.read_text()), "campaign" if path.stem == "campaign" else "scenario")


def test_files_that_are_written_have_only_what_is_described(calibrated):
    directory, _ = calibrated
    check(toml((directory / "pass" / "pass.toml").read_text()), "pass")
    check(json.loads((directory / "pass" / "truth.json").read_text()), "truth", only_described=True)
    check(json.loads((directory / "out" / "calibration.json").read_text()), "calibration", only_described=True)
    check(toml((directory / "out" / "effective-config.toml").read_text()), "config")


def test_outputs_have_only_what_is_described(calibrated):
    directory, calibration = calibrated
    check(calibration, "calibrate-output", only_described=True)
    told = ("--config", directory / "told.toml")
    outputs = {
        "inspect-output": ("inspect", directory / "pass"),
        "navigate-output": ("navigate", directory / "pass", "--prior", "-o", directory / "before.csv", *told),
        "replay-output": ("replay", directory / "pass", "--speed", "max", *told),
        "evaluate-output": ("evaluate", directory / "pass", "--attitude", directory / "before.csv", "--before", directory / "before.csv"),
        "observe-output": ("observe", directory / "pass", *told),
        "history-output": ("history", directory / "c.db"),
        "export-output": ("export", directory / "before.csv", "--format", "aem", "-o", directory / "a.aem", "--pass", directory / "pass"),
        "import-output": ("import", directory / "a.aem", "-o", directory / "a.csv"),
    }
    for name, arguments in outputs.items():
        result = run("--json", *arguments)
        assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
        check(json.loads(result.stdout), name, only_described=True)
    simulated = run("--json", "simulate", directory / "scenario.toml", "-o", directory / "again.nc")
    check(json.loads(simulated.stdout), "inspect-output")


def test_a_navigation_that_has_lost_a_gyro_tells_no_readiness(flown, tmp_path):
    shutil.copytree(flown / "pass", tmp_path / "pass")
    samples = tmp_path / "pass" / "gyro.csv"
    header, *lines = samples.read_text().splitlines()
    lost = len(lines) - len(lines) // 5  # 20 minutes before the end the second gyro stands still
    reading = lines[lost].split(",")[4:]
    samples.write_text("\n".join([header, *lines[:lost], *(",".join(line.split(",")[:4] + reading) for line in lines[lost:])]) + "\n")
    arguments = ("navigate", tmp_path / "pass", "--prior", "-o", tmp_path / "a.csv", "--config", flown / "told.toml", "--need", "5arcmin for 1min")
    result = run("--json", *arguments)
    assert result.returncode == DO_NOT_USE, result.stderr
    told = json.loads(result.stdout)
    check(told, "navigate-output", only_described=True)
    assert told["readiness"] is None and not told["verdict"]["trustworthy"]
    assert any(finding["code"] == "gyro-stuck" and "no pair" in finding["text"] for finding in told["verdict"]["findings"])
    text = run(*arguments)
    assert text.returncode == DO_NOT_USE and "gyro-stuck" in text.stdout
    assert "Readiness" not in text.stdout and "the need of" not in text.stdout


def test_a_clock_that_steps_is_described(tmp_path):
    """One star tracker, stamps 0.1 s later for half an hour: fixes were taken that much before their stamp."""
    assert run("--quiet", "simulate", "-", "-o", tmp_path / "pass", input='[scenario]\nseed = 3\nduration = "100min"\n').returncode == TRUSTWORTHY
    fixes = tmp_path / "pass" / "star_tracker.csv"
    header, *lines = fixes.read_text().splitlines()
    rows = [line.split(",", 1) for line in lines]
    late = [f"{float(t) + (0.1 if 2400 <= float(t) < 4200 else 0):.6f},{rest}" for t, rest in rows]
    fixes.write_text("\n".join([header, *late]) + "\n")
    told = json.loads(run("--json", "inspect", tmp_path / "pass").stdout)
    check(told, "inspect-output", only_described=True)
    step = told["clocks"]["step"]
    assert step["gyro"] == 0 and step["change_s"] == pytest.approx(-0.1, abs=4 * step["change_sigma_s"])


@pytest.mark.long
def test_outputs_of_several_passes_and_of_advice_have_only_what_is_described(flown, tmp_path):
    told = ("--config", flown / "told.toml")
    later = SCENARIO.replace("[scenario]", '[scenario]\nepoch_tai = "2009-05-20T09:00:00"')
    assert run("--quiet", "simulate", "-", "-o", tmp_path / "later", input=later).returncode == TRUSTWORTHY
    (tmp_path / "later" / "pass.toml").write_text((tmp_path / "later" / "pass.toml").read_text().replace("[gyro]\n", '[gyro]\nstart_up = "x"\n'))
    several = run("--json", "calibrate", flown / "pass", tmp_path / "later", "-o", tmp_path / "out", *told, "--catalogue", tmp_path / "c.db")
    check(json.loads(several.stdout), "calibrate-output", only_described=True)
    history = run("--json", "history", tmp_path / "c.db")
    check(json.loads(history.stdout), "history-output", only_described=True)
    steady = SCENARIO.replace("100min", "40min").replace("[gyro.drift]", '[attitude]\nslews = "none"\n[gyro.drift]')
    advice = run("--json", "observe", "-", *told, "--advise", "--slews", "1", "--confirm", "2", input=steady)
    check(json.loads(advice.stdout), "observe-output", only_described=True)


# What a schema refuses, the reader refuses, and the other way round.

CONFIG = run("calibrate", "--print-config").stdout
PAPER = (ROOT / "examples" / "paper.toml").read_text()


def refused_by_reader(text, name, flown):
    if name == "config":
        result = run("calibrate", "--print-config", "--config", "-", input=text)
    elif name == "scenario":
        result = run("simulate", "-", "-o", "/proc/nowhere", input=text)
    else:
        directory = flown / "edited"
        directory.mkdir(exist_ok=True)
        for table in ("gyro.csv", "star_tracker.csv", "star_tracker_2.csv"):
            if not (directory / table).exists():
                (directory / table).symlink_to(flown / "pass" / table)
        (directory / "pass.toml").write_text(text)
        result = run("inspect", directory)
    assert result.returncode in (TRUSTWORTHY, INPUT_REFUSED, MACHINE_FAILED), result.stderr
    return result.returncode == INPUT_REFUSED


@pytest.fixture(scope="module", params=["config", "scenario", "pass"])
def whole(request, flown):
    """A file with most of its keys, and what reads it."""
    pass_toml = (flown / "pass" / "pass.toml").read_text()
    text = {"config": CONFIG, "scenario": PAPER, "pass": pass_toml}[request.param]
    if request.param != "scenario":  # that is simulated by other tests, for seconds
        assert not refused_by_reader(text, request.param, flown)
    assert is_valid(toml(text), request.param)
    return request.param, text


def edits(text):
    """Each table with a key more, each key with a value of the wrong type."""
    lines = text.splitlines()
    for i, line in enumerate(lines):
        if line.startswith("["):
            yield "\n".join(lines[:i + 1] + ["not_a_key = 1"] + lines[i + 1:])
        elif re.match(r"\w+ = ", line):
            yield "\n".join(lines[:i] + [line.split(" = ")[0] + " = true"] + lines[i + 1:])
    yield "not_a_key = 1\n" + text


@pytest.mark.long  # the readers are fuzzed under the sanitizers
def test_unknown_keys_and_wrong_types_are_refused_by_schema_and_reader(whole, flown):
    name, text = whole
    tried = 0
    for edited in edits(text):
        assert not is_valid(toml(edited), name), edited
        assert refused_by_reader(edited, name, flown), edited
        tried += 1
    assert tried > 15


def test_an_orbit_by_its_file_is_refused_by_schema_and_reader_alike(flown):
    """In place of the elements that the whole scenario has."""
    text = '[orbit]\nephemeris = "orbit.oem"\n'
    assert is_valid(toml(text), "scenario")
    for edited in edits(text):
        assert not is_valid(toml(edited), "scenario"), edited
        assert refused_by_reader(edited, "scenario", flown), edited


@pytest.mark.parametrize("name, key, value", [
    ("config", "gate_nis", "-1"), ("config", "gate_nis", "1e300"), ("config", "student_t_freedom", "-2"), ("config", "reopen_after_rejections", "0"),
    ("config", "reopen_after_rejections", "1.5"), ("config", "noise", '"maybe"'), ("config", "estimator", '"magic"'),
    ("config", "drift_model", '"vsh:9"'), ("config", "angles_after", '"1 parsec"'), ("config", "interval", '"now"'),
    ("config", "wandering_drift", '"1arcsec"'), ("config", "wandering_drift", '"on"'), ("scenario", "seed", "-1"), ("scenario", "seed", "0.5"),
    ("scenario", "perigee_altitude", '"360"'), ("scenario", "perigee_altitude", '"inf km"'), ("scenario", "reference", '"sideways"'),
    ("scenario", "bias", '["0arcsec"]'), ("scenario", "gaps", "[{begin = 1}]"), ("scenario", "epoch_tai", '"noon"'),
    ("pass", "readout_noise_rad", "2"), ("pass", "duration_s", "59"), ("pass", "noise_rad", "[1e-5, 1e-5]"), ("pass", "noise_rad", "[1e-5, 1e-5, 0]"),
    ("pass", "epoch_tai", '"2009-05-20"'), ("pass", "spacecraft", "7"),
])
def test_values_out_of_range_are_refused_by_schema_and_reader(flown, name, key, value):
    text = {"config": CONFIG, "scenario": PAPER, "pass": (flown / "pass" / "pass.toml").read_text()}[name]
    edited = re.sub(rf"^{key} = [^#\n]*", lambda _: f"{key} = {value} ", text, count=1, flags=re.MULTILINE)
    assert edited != text
    assert not is_valid(toml(edited), name)
    assert refused_by_reader(edited, name, flown)


@pytest.mark.parametrize("name", ["config", "scenario", "pass"])
@pytest.mark.parametrize("version", ["0", "2", "1.0", '"1"'])
def test_another_version_is_refused_with_both(flown, name, version):
    text = {"config": CONFIG, "scenario": PAPER, "pass": (flown / "pass" / "pass.toml").read_text()}[name]
    plain_text = re.sub(r"^version = .*\n", "", text, flags=re.MULTILINE)
    edited = f"version = {version}\n" + plain_text
    assert is_valid(toml("version = 1\n" + plain_text), name)
    assert refused_by_reader(edited, name, flown)
    if version != "1.0":  # the same number in JSON
        assert not is_valid(toml(edited), name)


def test_files_of_another_version_are_refused_with_both_versions(tmp_path):
    """Those that name other files, and what is asked of a version that no reader here has."""
    for example, command in ((ROOT / "examples" / "campaign.toml", ("campaign", "-o", tmp_path / "out")),
                             (ROOT / "examples" / "telemetry" / "telemetry.toml", ("inspect",))):
        file = tmp_path / example.name
        file.write_text("version = 2\n" + example.read_text())
        result = run(command[0], file, *command[1:])
        assert result.returncode == INPUT_REFUSED
        assert f'{file}:1:11: "version" is 2, this program reads 1; use the program that wrote the file' in result.stderr


@pytest.mark.parametrize("name, key", [("pass", "spacecraft"), ("pass", "duration_s"), ("pass", "readout_noise_rad"), ("pass", "noise_rad")])
def test_missing_keys_are_refused_by_schema_and_reader(flown, name, key):
    text = re.sub(rf"^{key} = .*\n", "", (flown / "pass" / "pass.toml").read_text(), count=1, flags=re.MULTILINE)
    assert not is_valid(toml(text), name)
    assert refused_by_reader(text, name, flown)


def test_a_calibration_that_its_schema_refuses_is_refused(calibrated):
    directory, _ = calibrated
    whole_one = json.loads((directory / "out" / "calibration.json").read_text())

    def edited(path, value):
        document = copy.deepcopy(whole_one)
        place = document
        for step in path[:-1]:
            place = place[step]
        if value is None:
            del place[path[-1]]
        else:
            place[path[-1]] = value
        return document

    for path, value in [(["format"], "another"), (["version"], 2), (["estimator"], "magic"), (["epoch_tai"], "noon"), (["t_s"], "0"), (["gyros"], []),
                        (["gyros", 0, "momentum_in"], [1, 0]), (["gyros", 0, "drift_model"], None), (["gyros", 0, "drift_rad_s", "k0"], 1e10),
                        (["covariance", "matrix", 0, 0], "1"), (["covariance", "states"], None), (["verdict", "trustworthy"], "yes"),
                        (["verdict", "findings"], [{"code": "x"}]), (["noise", "wandering_drift_rad_s"], -1), (["statistics"], None),
                        (["clocks"], {"clock_offset_s": 1.0, "clock_rate_s_s": 0.0}),
                        (["clocks"], {"clock_offset_s": "1 s", "clock_rate_s_s": 0.0, "latency_s": [0.0, 0.0]})]:
        document = edited(path, value)
        assert not is_valid(document, "calibration"), path
        result = run("navigate", directory / "pass", "--calibration", "-", "-o", directory / "a.csv", input=json.dumps(document))
        assert result.returncode == INPUT_REFUSED, (path, result.stderr)
    clocks = edited(["clocks"], {"clock_offset_s": 1e-3, "clock_rate_s_s": 0.0, "latency_s": [0.0, 0.0]})
    assert is_valid(clocks, "calibration")
    result = run("navigate", directory / "pass", "--calibration", "-", "-o", directory / "a.csv", input=json.dumps(clocks))
    assert "clock-offset-found" in result.stdout, result.stderr
    later = edited(["added_later"], {"any": "thing"})
    assert is_valid(later, "calibration")
    result = run("--quiet", "navigate", directory / "pass", "--calibration", "-", "-o", directory / "a.csv", input=json.dumps(later))
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
