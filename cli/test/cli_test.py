"""The program as users run it: outputs, exit status, messages. Run by CTest with TRIHEDRON_BUILD naming the build directory."""
import atexit
import csv
import json
import pathlib
import resource
import signal
import subprocess
import tempfile

import pytest
import xarray

from program import DO_NOT_USE, INPUT_REFUSED, MACHINE_FAILED, PROGRAM, ROOT, TOLD, TRUSTWORTHY, WRONG_USAGE, refused, run


def simulated(scenario):
    """A pass by this scenario in a directory that goes with the process."""
    directory = tempfile.TemporaryDirectory()
    atexit.register(directory.cleanup)
    path = pathlib.Path(directory.name)
    (path / "scenario.toml").write_text(scenario)
    result = run("--quiet", "simulate", path / "scenario.toml", "-o", path / "pass.nc")
    assert result.returncode == 0, result.stderr
    return path / "pass.nc"


SCENARIO = """
[scenario]
seed = 1
duration = "{duration}"
[gyro]
period = "{period}"
[gyro.drift]
outside_sigma = "0rad/s"
"""
# Half of the paper's experiment, all drift in eq. (1), and gyros sampled half as often, which is half the work.
EXAMPLE = simulated(SCENARIO.format(duration="270min", period="250ms"))


@pytest.fixture(scope="session")
def hour():
    """Its pass.toml, and the columns of its tables. As often sampled as in the paper."""
    path = simulated(SCENARIO.format(duration="60min", period="125ms"))
    columns = {}
    for group in ("gyro", "star_tracker"):
        with xarray.open_dataset(path, group=group, decode_times=False) as data:
            columns[group] = {name: data[name].values for name in data.variables}
    return xarray.open_dataset(path).attrs["pass_toml"], columns


@pytest.fixture
def csv_pass(tmp_path, hour):
    """The first minutes of the hour as a CSV directory, without its truth."""

    def make(minutes=20, toml_edit=None):
        directory = tmp_path / "pass"
        directory.mkdir()
        toml, columns = hour
        lines = [f"duration_s = {60.0 * minutes}" if line.startswith("duration_s") else line for line in toml.splitlines()]
        text = "\n".join(lines) + "\n"
        (directory / "pass.toml").write_text(toml_edit(text) if toml_edit else text)
        for group, names in (("gyro", ["t_s"] + [f"h{k}_{a}" for k in (1, 2) for a in "xyz"]),
                             ("star_tracker", ["t_s", "q_x", "q_y", "q_z", "q_w"])):
            data = columns[group]
            with open(directory / f"{group}.csv", "w", newline="") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(names)
                for row in zip(*(data[name] for name in names)):
                    if row[0] <= 60 * minutes:
                        writer.writerow([f"{row[0]:.3f}"] + [f"{value:.9f}" for value in row[1:]])
        return directory

    return make


def edit_lines(path, edit):
    lines = path.read_text().splitlines(keepends=True)
    edit(lines)
    path.write_text("".join(lines))


# What the commands give.


def test_inspect_says_what_a_pass_holds():
    result = run("inspect", EXAMPLE)
    assert result.returncode == TRUSTWORTHY
    assert "samples of 2 gyros" in result.stdout
    facts = json.loads(run("--json", "inspect", EXAMPLE).stdout)
    assert facts["gyros"] == 2
    assert facts["gyro_samples"] > 50_000


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory):
    out = tmp_path_factory.mktemp("calibrated")
    result = run("calibrate", EXAMPLE, "-o", out, "--estimator", "paper")
    assert result.returncode == TRUSTWORTHY, result.stderr + result.stdout
    return out, result.stdout


@pytest.mark.long
def test_a_drift_model_for_the_whole_pass_is_calibrated_reported_and_navigates(tmp_path):
    out = tmp_path / "out"
    result = run("calibrate", EXAMPLE, "-o", out, "--drift-model", "vsh:2", "--definitive", "--json")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    outcome = json.loads(result.stdout)
    models = outcome["drift_models"]
    assert [model["drift_model"] for model in models] == ["esg7", "vsh:1", "vsh:2"]
    assert [model["coefficients"] for model in models] == [7, 13, 19]
    assert models[2]["log_likelihood"] < 0 == models[0]["log_likelihood"]  # all drift is in eq. (1)
    assert [finding["code"] for finding in outcome["calibration"]["verdict"]["findings"]] == ["drift-model-too-large"]
    gyro = json.loads((out / "calibration.json").read_text())["gyros"][0]
    assert gyro["drift_model"] == "vsh:2" and list(gyro["drift_rad_s"])[:8] == [*COEFFICIENTS, "W(1,-1)"]
    assert 'data-figure="drift_models"' in (out / "report.html").read_text()
    with open(out / "definitive-attitude.csv") as file:
        assert sum(1 for _ in file) == 2 + 270 * 60 * 4  # a header, and a sample at both ends
    navigated = run("navigate", EXAMPLE, "-o", tmp_path / "a.csv", "--calibration", out / "calibration.json")
    assert navigated.returncode == TRUSTWORTHY, navigated.stderr


def test_calibrate_writes_what_is_pinned(calibrated):
    out, _ = calibrated
    assert sorted(f.name for f in out.iterdir()) == ["attitude.csv", "calibration.json", "effective-config.toml", "report.html",
                                                     "residuals.nc"]
    calibration = json.loads((out / "calibration.json").read_text())
    assert calibration["format"] == "trihedron-calibration"
    assert len(calibration["gyros"]) == 2
    assert calibration["covariance"]["states"][7:11] == ["gyro1.align_x", "gyro1.align_y", "gyro1.align_z", "gyro2.k0"]
    assert calibration["verdict"]["trustworthy"] is True
    with xarray.open_dataset(out / "residuals.nc", group="fixes") as residuals:
        assert 3.8 < float(residuals["nis"][residuals["used"] == 1].mean()) < 4.2
    with xarray.open_dataset(out / "residuals.nc", group="parameters") as parameters:
        assert parameters["gyro2_align_z_sigma"].attrs["units"] == "rad"
    with open(out / "attitude.csv") as file:
        header = file.readline().strip()
    assert header.startswith("t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad")


def arcsec(text):
    return float(text[:-1]) * {"″": 1, "′": 60, "°": 3600}[text[-1]]


def alignment_errors_arcsec(text):
    """Estimate less truth, and sigma, of each component that the text of `calibrate` lists."""
    rows = [line.split() for line in text.splitlines() if line.strip().startswith("align_")]
    assert len(rows) == 6
    return [(arcsec(row[4]), arcsec(row[3])) for row in rows]  # name, value, its unit, sigma, error


def test_calibrate_finds_the_truth_of_the_example(calibrated):
    _, text = calibrated
    for error, sigma in alignment_errors_arcsec(text):
        assert abs(error) < 4 * sigma < 4 * 5


# One hour, all drift in eq. (1), and gyros sampled at this period.
OF_A_RATE = """
[scenario]
seed = 11
duration = "60min"
[gyro]
period = "{period}"
[gyro.drift]
outside_sigma = "0rad/s"
"""


@pytest.mark.long
@pytest.mark.parametrize("period, told, evidence", [
    ("1s", ["gyro-samples-far-apart"], "sampled every 1 s"),
    ("125ms", [], ""),
    ("20ms", ["gyro-samples-thinned"], "135000 of 180001 samples left out"),
])
def test_gyros_of_any_rate_are_calibrated_and_a_limit_is_told(tmp_path, period, told, evidence):
    rated = simulated(OF_A_RATE.format(period=period))
    (tmp_path / "told.toml").write_text(TOLD)
    result = run("calibrate", rated, "-o", tmp_path / "out", "--config", tmp_path / "told.toml")
    assert result.returncode == TRUSTWORTHY, result.stdout + result.stderr
    for error, sigma in alignment_errors_arcsec(result.stdout):
        assert abs(error) < 4 * sigma < 4 * 60  # an hour without slews tells pitch from drift no better
    findings = json.loads((tmp_path / "out" / "calibration.json").read_text())["verdict"]["findings"]
    of_rate = [finding for finding in findings if finding["code"].startswith("gyro-samples-")]
    assert [finding["code"] for finding in of_rate] == told
    assert all(evidence in finding["evidence"] for finding in of_rate)


def test_effective_config_repeats_the_run(csv_pass, tmp_path):
    directory = csv_pass()
    first = run("calibrate", directory, "-o", tmp_path / "first", "--estimator", "paper")
    again = run("calibrate", directory, "-o", tmp_path / "again", "--config", tmp_path / "first" / "effective-config.toml")
    assert first.returncode == again.returncode and first.returncode in (TRUSTWORTHY, DO_NOT_USE), first.stderr
    assert (tmp_path / "again" / "calibration.json").read_bytes() == (tmp_path / "first" / "calibration.json").read_bytes()


def test_invariant_estimator_with_further_states(tmp_path):
    (tmp_path / "config.toml").write_text(
        'drift_model = "esg7"\n'
        '[filter]\nstudent_t_freedom = 8\nreopen_after_jump_rejections = 300\nangles_after = "never"\n'
        '[further_states]\nclock_offset = "on"\norbital_error = "on"\nreadout_bias = "on"\n'
        'wandering_drift = "1e-9rad/s"\nwandering_time = "30min"\n')
    result = run("calibrate", EXAMPLE, "-o", tmp_path / "out", "--config", tmp_path / "config.toml")
    assert result.returncode == TRUSTWORTHY, result.stderr + result.stdout
    assert "clock_offset_s" in result.stdout
    further = json.loads((tmp_path / "out" / "calibration.json").read_text())["further"]
    assert len(further) == 7 + 6
    assert abs(further["clock_offset_s"]["value"]) < 4 * further["clock_offset_s"]["sigma"] < 4e-3
    effective = (tmp_path / "out" / "effective-config.toml").read_text()
    for setting in ('wandering_time = "30min"', "student_t_freedom = 8", "reopen_after_jump_rejections = 300",
                    'angles_after = "never"', 'readout_bias = "on"'):
        assert setting in effective


def test_ten_minutes_say_in_the_first_line_what_they_are_good_for_and_by_the_status_what_not(csv_pass, tmp_path):
    settings = tmp_path / "told.toml"
    settings.write_text(TOLD)
    directory = csv_pass(10)
    options = ("calibrate", directory, "-o", tmp_path / "out", "--config", settings)
    without = run(*options)
    first = without.stdout.splitlines()[0]
    assert without.returncode == TRUSTWORTHY, without.stdout
    assert first.startswith("Verdict     trustworthy: attitude within 5′ for "), first
    assert " of 14 drift coefficients not determined" in first
    unmet = run(*options, "--need", "5arcmin for 270min")
    assert unmet.returncode == DO_NOT_USE
    assert unmet.stdout.startswith("Verdict     DO NOT USE: need-not-met; attitude within 5′ for ")
    calibration = json.loads((tmp_path / "out" / "calibration.json").read_text())
    need = calibration["forecast"]["need"]
    assert not need["met"] and need["error_rad"] == pytest.approx(0.0014544, rel=1e-4) and need["interval_s"] == 16200
    # The evidence names what the error is made of; the cure the time for which the need is met.
    finding = next(f for f in calibration["verdict"]["findings"] if f["code"] == "need-not-met")
    assert need["causes"][0]["name"] in finding["evidence"] and "orrect every" in finding["cure"]
    kept_s = need["within"]["time_s"]
    assert 0 < kept_s < 16200
    # A need that is a little less is met.
    met = run(*options, "--need", f"5arcmin for {int(kept_s) - 1}s")
    assert met.returncode == TRUSTWORTHY and "is met" in met.stdout.splitlines()[0]
    # The same by the settings, which the result repeats.
    settings.write_text('need = "5arcmin for 270min"\n' + TOLD)
    assert run(*options).returncode == DO_NOT_USE
    assert 'need = "5arcmin for 270min"' in (tmp_path / "out" / "effective-config.toml").read_text()


@pytest.fixture(scope="session")
def navigated(calibrated, tmp_path_factory):
    """By that calibration: the attitude, and what is said of it."""
    out, _ = calibrated
    attitude = tmp_path_factory.mktemp("navigated") / "attitude.csv"
    result = run("--json", "navigate", EXAMPLE, "--calibration", out / "calibration.json", "-o", attitude)
    assert result.returncode == TRUSTWORTHY, result.stderr + result.stdout
    return attitude, json.loads(result.stdout)


@pytest.fixture(scope="session")
def held(tmp_path_factory):
    """The attitude without a calibration, corrected every hour, and what is said of it."""
    attitude = tmp_path_factory.mktemp("held") / "attitude.csv"
    result = run("--json", "navigate", EXAMPLE, "--prior", "-o", attitude, "--correction-interval", "60min")
    return attitude, json.loads(result.stdout)


@pytest.mark.long
def test_navigate_says_how_long_the_attitude_will_hold(calibrated, navigated, held, tmp_path):
    readiness = navigated[1]["readiness"]
    assert readiness["limit_rad"] == pytest.approx(0.0014544, rel=1e-4)
    assert readiness["time_s"] > 4 * 3600
    need = run("navigate", EXAMPLE, "--calibration", calibrated[0] / "calibration.json", "-o", tmp_path / "attitude.csv", "--need",
               "0.1arcsec for 270min")
    assert need.returncode == DO_NOT_USE and "need-not-met" in need.stdout
    assert held[1]["readiness"]["time_s"] < readiness["time_s"] / 10


@pytest.fixture(scope="session")
def outcome(tmp_path_factory):
    """Of a calibration of the example by default, as JSON."""
    return json.loads(run("calibrate", EXAMPLE, "-o", tmp_path_factory.mktemp("outcome"), "--json").stdout)


@pytest.mark.long
def test_json_is_one_document(outcome):
    assert outcome["calibration"]["verdict"]["trustworthy"] is True
    assert outcome["navigation"]["reference"] == "truth"


def test_quiet_prints_nothing(csv_pass, tmp_path):
    result = run("--quiet", "calibrate", csv_pass(), "-o", tmp_path / "out", "--estimator", "paper")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE)
    assert (result.stdout, result.stderr) == ("", "")


def evaluated(attitude):
    evaluation = run("--json", "evaluate", EXAMPLE, "--attitude", attitude)
    assert evaluation.returncode == TRUSTWORTHY, evaluation.stderr
    return json.loads(evaluation.stdout)


def navigate_and_evaluate(tmp_path, *options):
    attitude = tmp_path / "attitude.csv"
    result = run("navigate", EXAMPLE, *options, "-o", attitude)
    assert result.returncode == TRUSTWORTHY, result.stderr + result.stdout
    return evaluated(attitude)


ARCSECOND = 4.8481e-6


@pytest.mark.long
def test_navigation_online_improves_with_each_correction(tmp_path):
    stretches = navigate_and_evaluate(tmp_path, "--online")["per_90_min"]
    # A stretch begins with what the last correction left: the next one waits for the samples round its fix.
    assert stretches[0]["max_total_rad"] > 600 * ARCSECOND
    assert stretches[1]["max_total_rad"] < stretches[0]["max_total_rad"] / 4
    assert all(s["max_total_rad"] < 20 * ARCSECOND for s in stretches[2:])


@pytest.mark.long
def test_navigation_by_a_calibration_is_good_from_the_start(navigated):
    evaluation = evaluated(navigated[0])
    assert all(s["max_total_rad"] < 60 * ARCSECOND for s in evaluation["per_90_min"])
    assert [round(c["t_s"]) for c in evaluation["corrections"]][:2] == [0, 5400]


@pytest.mark.long
def test_navigation_without_corrections_and_with_each_fix(calibrated, tmp_path):
    out, _ = calibrated
    once = navigate_and_evaluate(tmp_path, "--calibration", out / "calibration.json", "--correction-interval", "none")
    assert len(once["corrections"]) == 1
    each = navigate_and_evaluate(tmp_path, "--online", "--correction-interval", "continuous")
    assert len(each["corrections"]) > 1000
    assert each["per_90_min"][-1]["max_total_rad"] < 30 * ARCSECOND


@pytest.mark.long
def test_a_calibration_of_another_start_up_is_not_to_be_used(calibrated, tmp_path):
    out, _ = calibrated
    calibration = json.loads((out / "calibration.json").read_text())
    for gyro in calibration["gyros"]:
        gyro["drift_rad_s"]["nu12"] += 5e-7
    other = tmp_path / "other.json"
    other.write_text(json.dumps(calibration))
    result = run("navigate", EXAMPLE, "--calibration", other, "-o", tmp_path / "attitude.csv")
    assert result.returncode == DO_NOT_USE
    assert "DO NOT USE" in result.stdout


@pytest.mark.long
def test_extension_of_the_correction_interval_by_attitude_files(calibrated, held, tmp_path):
    out, _ = calibrated
    run("navigate", EXAMPLE, "--calibration", out / "calibration.json", "-o", tmp_path / "after.csv", "--correction-interval", "60min")
    files = ("evaluate", EXAMPLE, "--attitude", tmp_path / "after.csv", "--before", held[0])
    assert "correction interval extended ≥ " in run(*files).stdout
    extension = json.loads(run("--json", *files).stdout)["extension"]
    assert len(extension["corrections"]) == 5
    assert extension["corrections"][1]["known_before"]["passed_limit_after_s"] < 1800
    assert extension["corrections"][1]["calibrated"]["passed_limit_after_s"] is None
    assert extension["is_lower_bound"] is True and extension["factor"] > 3


@pytest.mark.long
def test_calibrate_measures_convergence_and_extension(outcome):
    assert 0 < outcome["convergence"]["alignment_s"] < 90 * 60
    assert sum("(" not in name for name in outcome["convergence"]["states"]) == 20  # beside the members outside eq. (1)
    assert [c["t_s"] for c in outcome["extension"]["corrections"]] == [0, 5400, 10800, 16200]
    assert outcome["extension"]["factor"] > 3


def test_simulate_says_what_the_pass_is_too_short_for(tmp_path):
    (tmp_path / "s.toml").write_text('[scenario]\nduration = "4min"\n[attitude]\n'
                                     'slews = [{begin = "3min", roll = "30deg"}, {begin = "1h"}]\n'
                                     '[star_tracker]\noutages = [{begin = "5min", end = "6min"}]\n')
    lines = ["1 of 2 slews begins after the end of the pass", "the slew that begins at 3min is not over by the end of the pass",
             "1 of 1 outages of the star tracker begins after the end of the pass"]
    result = run("simulate", tmp_path / "s.toml", "-o", tmp_path / "p")
    assert result.returncode == TRUSTWORTHY
    assert [line[12:] for line in result.stdout.splitlines() if line.startswith("Left out")] == lines
    assert json.loads(run("--json", "simulate", tmp_path / "s.toml", "-o", tmp_path / "p").stdout)["left_out"] == lines
    (tmp_path / "s.toml").write_text('[scenario]\nduration = "4min"\n[gyro]\nmounting_step_at = "5min"\n')
    result = run("simulate", tmp_path / "s.toml", "-o", tmp_path / "p")
    assert "Left out" not in result.stdout


def test_simulate_says_which_steps_come_after_the_end_of_the_pass(tmp_path):
    (tmp_path / "s.toml").write_text('[scenario]\nduration = "4min"\n[gyro.drift]\njump_at = "5min"\n[[gyro.unit]]\ndrift = {jump_sigma = "1e-8rad/s"}\n'
                                     '[[gyro.unit]]\nmounting_step = ["0deg", "1arcmin", "0deg"]\nmounting_step_at = "4min"\n'
                                     '[star_tracker]\ninertial_step = ["1arcmin", "0deg", "0deg"]\ninertial_step_at = "1h"\n'
                                     '[[star_tracker.further]]\ninertial_step_at = "1min"\nmounting_step = ["1arcmin", "0deg", "0deg"]\nmounting_step_at = "1d"\n')
    result = run("simulate", tmp_path / "s.toml", "-o", tmp_path / "p")
    assert [line[12:] for line in result.stdout.splitlines() if line.startswith("Left out")] == [
        "the jump of the coefficients of gyro 1 at 5min is after the end of the pass",
        "the step of the mounting of gyro 2 at 4min is after the end of the pass",
        "the step of the inertial axes of the star tracker at 1h is after the end of the pass",
        "the step of the mounting of star tracker 2 at 1d is after the end of the pass"]


# Nine hours of paper.toml are calibrated by the demonstration, of steady-flight.toml as a pass of validation/passes: here four of the others, which
# hold what they have happen, with nothing to decide: decisions on a pass as dirty are tested with those of validation/passes. The pages of docs/ fly
# short.toml.
@pytest.mark.long
@pytest.mark.parametrize("scenario", sorted(path for path in (ROOT / "examples").glob("*.toml")
                                            if path.stem not in ("campaign", "paper", "short", "steady-flight")), ids=lambda path: path.stem)
def test_examples_simulate_and_calibrate(scenario, tmp_path):
    assert run("--quiet", "simulate", scenario, "-o", tmp_path / "pass.nc").returncode == TRUSTWORTHY
    four_hours = tmp_path / "four_hours.toml"
    text = scenario.read_text().replace('duration = "9h"\n', "")
    four_hours.write_text(text.replace("[scenario]\n", '[scenario]\nduration = "4h"\n', 1))
    assert run("--quiet", "simulate", four_hours, "-o", tmp_path / "four_hours.nc").returncode == TRUSTWORTHY
    assert json.loads(run("--json", "inspect", tmp_path / "four_hours.nc").stdout)["duration_s"] == 4 * 3600
    (tmp_path / "told.toml").write_text(TOLD)
    result = run("--quiet", "calibrate", tmp_path / "four_hours.nc", "-o", tmp_path / "out", "--config", tmp_path / "told.toml")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr


@pytest.mark.long
def test_the_papers_example_says_the_defaults(tmp_path):
    (tmp_path / "empty.toml").write_text("")
    for name, scenario in (("empty", tmp_path / "empty.toml"), ("paper", ROOT / "examples" / "paper.toml")):
        run("--quiet", "simulate", scenario, "-o", tmp_path / f"{name}.nc")
    assert (tmp_path / "empty.nc").read_bytes() == (tmp_path / "paper.nc").read_bytes()


def test_evaluation_without_truth_is_against_the_star_tracker(csv_pass, tmp_path):
    directory = csv_pass()
    run("navigate", directory, "--online", "-o", tmp_path / "attitude.csv")
    result = run("evaluate", directory, "--attitude", tmp_path / "attitude.csv", "--limit", "1deg")
    assert result.returncode == TRUSTWORTHY
    assert "against the star tracker" in result.stdout


def test_evaluation_takes_its_truth_from_standard_input_and_one_file_alone(csv_pass, tmp_path):
    directory = csv_pass()
    run("navigate", directory, "--online", "-o", tmp_path / "a.csv")
    evaluation = ("--json", "evaluate", directory, "--attitude", tmp_path / "a.csv", "--truth")
    by_file = run(*evaluation, tmp_path / "a.csv")
    assert by_file.returncode == TRUSTWORTHY, by_file.stderr
    assert run(*evaluation, "-", input=(tmp_path / "a.csv").read_text()).stdout == by_file.stdout
    refused(run("evaluate", directory, "--attitude", "-", "--before", "-"), WRONG_USAGE, "standard input")


def test_installed_help_names_every_command():
    result = run("--help")
    assert result.returncode == 0
    for command in ("inspect", "calibrate", "navigate", "evaluate", "history"):
        assert command in result.stdout
    assert run("--version").stdout.strip()


@pytest.mark.long
def test_settings_give_the_correction_interval_unless_the_option_does(csv_pass, tmp_path):
    config = tmp_path / "config.toml"
    config.write_text("[corrections]\ninterval = \"5min\"\n")
    options = ("navigate", csv_pass(50), "--online", "--config", config, "-o", tmp_path / "attitude.csv")
    for more, corrections in ((), 10), (("--correction-interval", "none"), 1):
        assert len(json.loads(run("--json", *options, *more).stdout)["evaluation"]["corrections"]) == corrections


# Several passes, and the catalogue.

COEFFICIENTS = ("k0", "mu12", "mu23", "mu31", "nu12", "nu23", "nu31")


def pass_of_start_up(directory, name, day, hour, start_up=None):
    """100 min of gyros that are aligned alike on every day, with the drift coefficients of that day."""
    gyro = """
[[gyro.unit]]
start_direction_c = {}
misalignment = ["{}arcmin", "-9arcmin", "4arcmin"]
[gyro.unit.drift]
kappa = {{{}}}
"""
    units = [gyro.format(direction, 11 + unit, ", ".join(f'{c} = "{(day + 7 * unit + 3 * i) % 11 - 5}e-7rad/s"' for i, c in enumerate(COEFFICIENTS)))
             for unit, direction in enumerate(("[0.995, 0.087, 0.045]", "[0.14, 0.985, 0.094]"))]
    (directory / "scenario.toml").write_text(f"""
[scenario]
seed = {100 * day + hour}
epoch_tai = "2009-05-{day:02}T{hour:02}:00:00"
duration = "100min"
[gyro.drift]
outside_sigma = "0rad/s"
""" + "".join(units))
    path = directory / name
    result = run("--quiet", "simulate", directory / "scenario.toml", "-o", path)
    assert result.returncode == TRUSTWORTHY, result.stderr
    if start_up:
        toml = path / "pass.toml"
        toml.write_text(toml.read_text().replace("[gyro]\n", f'[gyro]\nstart_up = "{start_up}"\n'))
    return path


@pytest.fixture(scope="session")
def start_ups(tmp_path_factory):
    """Two passes of one start-up, one of the next, their settings, and a catalogue of all."""
    directory = tmp_path_factory.mktemp("start-ups")
    first, second = (pass_of_start_up(directory, f"{name}.nc", 20, hour) for name, hour in (("first", 0), ("second", 9)))
    third = pass_of_start_up(directory, "third", 23, 0, start_up="of the 23rd")
    (directory / "told.toml").write_text(TOLD)
    options = ("--config", directory / "told.toml", "--catalogue", directory / "catalogue.db", "--json")
    results = [run("calibrate", second, first, "-o", directory / "both", *options), run("calibrate", third, "-o", directory / "3", *options)]
    for result in results:
        assert result.returncode == TRUSTWORTHY, result.stderr + result.stdout
    return directory, json.loads(results[0].stdout)


def sigmas(calibration):
    return [row[i] ** 0.5 for i, row in enumerate(calibration["covariance"]["matrix"])]


def test_passes_of_one_start_up_are_combined_in_the_order_of_time(start_ups):
    directory, outcome = start_ups
    assert [p["name"] for p in outcome["passes"]] == ["first", "second"]
    assert "coefficients" not in outcome["passes"][0]
    assert outcome["passes"][1]["coefficients"]["holds"] and outcome["passes"][1]["alignments"]["holds"]
    results = ["attitude.csv", "calibration.json", "effective-config.toml", "report.html", "residuals.nc"]
    assert sorted(f.name for f in (directory / "both").iterdir()) == sorted(results + ["first", "second"])
    combined = json.loads((directory / "both" / "calibration.json").read_text())
    assert combined["epoch_tai"] == "2009-05-20T09:00:00"
    for name in ("first", "second"):
        assert sorted(f.name for f in (directory / "both" / name).iterdir()) == results
        alone = json.loads((directory / "both" / name / "calibration.json").read_text())
        assert all(both < one for both, one in zip(sigmas(combined), sigmas(alone)))


@pytest.mark.long
def test_passes_of_two_start_ups_are_not_to_be_used_together(start_ups, tmp_path):
    directory, _ = start_ups
    result = run("calibrate", directory / "first.nc", directory / "third", "-o", tmp_path / "out", "--config", directory / "told.toml")
    assert result.returncode == DO_NOT_USE
    assert "coefficients-moved" in result.stdout and "alignment-moved" not in result.stdout
    assert "The drift coefficients of third are not those of the passes before." in result.stdout


def test_passes_that_overlap_are_refused_with_the_pass_and_the_reason(start_ups, tmp_path):
    directory, _ = start_ups
    refused(run("calibrate", directory / "first.nc", directory / "first.nc", "-o", tmp_path / "out", "--config", directory / "told.toml"),
            INPUT_REFUSED, "first.nc", "begins before the one before it ends")
    assert not (tmp_path / "out").exists()


def test_history_compares_start_ups(start_ups, tmp_path):
    directory, _ = start_ups
    history = json.loads(run("--json", "history", directory / "catalogue.db").stdout)
    assert [(c["pass"], c["passes"], c["start_up"]) for c in history["calibrations"]] == [
        ("first", 1, "2009-05-20T00:00:00"), ("second", 1, "2009-05-20T00:00:00"), ("second", 2, "2009-05-20T00:00:00"),
        ("third", 1, "of the 23rd")]
    change, = history["changes"]
    assert (change["from"], change["to"]) == ("2009-05-20T00:00:00", "of the 23rd")
    assert not change["coefficients"]["holds"] and change["alignments"]["holds"]
    assert len(history["spreads"]) == 20 and history["findings"] == []
    result = run("history", directory / "catalogue.db", "-o", tmp_path / "history.html")
    assert result.returncode == TRUSTWORTHY, result.stderr
    for words in ("4 of Resurs-DK1, 2 start-ups", "Gyro 2, alignment", "From start-up 2009-05-20T00:00:00 to of the 23rd", "next 1σ"):
        assert words in result.stdout
    assert "figure-align_z" in (tmp_path / "history.html").read_text()


def test_a_file_that_is_no_catalogue_is_refused_and_left_alone(start_ups, tmp_path):
    directory, _ = start_ups
    other = tmp_path / "notes.txt"
    other.write_text("not a database " * 100)
    refused(run("history", other), INPUT_REFUSED, "notes.txt", "no database")
    refused(run("history", tmp_path / "nowhere.db"), INPUT_REFUSED, "nowhere.db", "no such catalogue")
    refused(run("calibrate", directory / "third", "-o", tmp_path / "out", "--config", directory / "told.toml", "--catalogue", other),
            INPUT_REFUSED, "notes.txt")
    assert not (tmp_path / "out").exists()
    assert other.read_text() == "not a database " * 100


def test_a_catalogue_that_cannot_be_written_is_a_machine_failure(start_ups, tmp_path):
    directory, _ = start_ups
    refused(run("calibrate", directory / "third", "-o", tmp_path / "out", "--config", directory / "told.toml", "--catalogue",
                tmp_path / "missing" / "c.db"), MACHINE_FAILED, "c.db", "check that the directory is there")


# Wrong usage.


@pytest.mark.parametrize("arguments, word", [
    ((), "subcommand"),
    (("nonsense",), "there is no nonsense"),
    (("calibrate", EXAMPLE), "--output"),
    (("history",), "CATALOGUE"),
    (("calibrate", EXAMPLE, "-o", "x", "--estimator", "magic"), "magic"),
    (("calibrate", EXAMPLE, "-o", "x", "--drift-model", "vsh:9"), "vsh:8"),
    (("calibrate", EXAMPLE, "-o", "x", "--estimator", "paper", "--definitive"), "--estimator"),
    (("navigate", EXAMPLE, "-o", "x"), "--online"),
    (("navigate", EXAMPLE, "-o", "x", "--online", "--calibration", "y"), "--online"),
    (("navigate", EXAMPLE, "-o", "x", "--online", "--correction-interval", "90"), "unit"),
    (("navigate", EXAMPLE, "-o", "x", "--online", "--correction-interval", "0min"), "it is the time between two corrections"),
    (("evaluate", EXAMPLE, "--attitude", "x", "--limit", "5"), "unit"),
    (("calibrate", EXAMPLE, "-o", "x", "--need", "5arcmin"), "5arcmin for 270min"),
    (("calibrate", EXAMPLE, "-o", "x", "--need", "5arcmin for 270"), "unit"),
    (("calibrate", EXAMPLE, "-o", "x", "--need", "5 for 270min"), "unit"),
    (("calibrate", EXAMPLE, "-o", "x", "--need", "270min for 5arcmin"), "angle"),
    (("calibrate", EXAMPLE, "-o", "x", "--need", "0arcmin for 270min"), "outside"),
    (("navigate", EXAMPLE, "-o", "x", "--online", "--need", "5arcmin for 0min"), "outside"),
])
def test_wrong_usage_is_told_in_one_line(arguments, word):
    refused(run(*arguments), WRONG_USAGE, word)


# Bad input: each refused with file, place, reason and cure, and nothing left behind.


def test_a_missing_pass_is_refused(tmp_path):
    refused(run("inspect", tmp_path / "nowhere"), INPUT_REFUSED, "nowhere")


def test_no_fix_at_all_is_refused(csv_pass, tmp_path):
    directory = csv_pass(2)
    edit_lines(directory / "star_tracker.csv", lambda lines: lines.__delitem__(slice(1, None)))
    refused(run("calibrate", directory, "-o", tmp_path / "out"), INPUT_REFUSED, "star_tracker.csv")
    assert not (tmp_path / "out").exists()


def test_a_silent_gyro_is_refused(csv_pass, tmp_path):
    directory = csv_pass(2)

    def silence(lines):
        for i in range(1, len(lines)):
            fields = lines[i].rstrip("\n").split(",")
            lines[i] = ",".join(fields[:4] + ["nan"] * 3) + "\n"

    edit_lines(directory / "gyro.csv", silence)
    refused(run("calibrate", directory, "-o", tmp_path / "out"), INPUT_REFUSED, "gyro.csv", "gyro 2")


def test_parallel_momenta_are_refused(csv_pass, tmp_path):
    directory = csv_pass(2)

    def against_each_other(lines):
        for i in range(1, len(lines)):
            fields = lines[i].rstrip("\n").split(",")
            lines[i] = ",".join(fields[:4] + [f"{-float(h):.9f}" for h in fields[1:4]]) + "\n"

    edit_lines(directory / "gyro.csv", against_each_other)
    refused(run("calibrate", directory, "-o", tmp_path / "out"), INPUT_REFUSED, "parallel")
    assert not (tmp_path / "out" / "calibration.json").exists()


def test_a_pass_shorter_than_a_minute_is_refused(csv_pass, tmp_path):
    refused(run("calibrate", csv_pass(0.5), "-o", tmp_path / "out"), INPUT_REFUSED, "minute")


def test_unordered_and_repeated_times_are_counted(csv_pass):
    directory = csv_pass(2)

    def disorder(lines):
        lines[100], lines[101] = lines[101], lines[100]
        lines.insert(200, lines[199])

    edit_lines(directory / "gyro.csv", disorder)
    kinds = {d["kind"]: d["count"] for d in json.loads(run("--json", "inspect", directory).stdout)["defects"]}
    assert sum(count for kind, count in kinds.items() if "backward" in kind) == 1
    assert sum(count for kind, count in kinds.items() if "repeated" in kind) == 1


def test_dirty_quaternions_are_counted_and_survived(csv_pass, tmp_path):
    directory = csv_pass(20)

    def dirty(lines):
        def rewrite(i, change):
            fields = lines[i].rstrip("\n").split(",")
            lines[i] = ",".join([fields[0]] + [change(f) for f in fields[1:]]) + "\n"
        rewrite(50, lambda f: "nan")
        rewrite(60, lambda f: "0.0")
        rewrite(70, lambda f: f[1:] if f.startswith("-") else "-" + f)

    edit_lines(directory / "star_tracker.csv", dirty)
    result = run("calibrate", directory, "-o", tmp_path / "out")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE)
    assert "2 rejected: not a rotation" in result.stdout
    assert "nan" not in (tmp_path / "out" / "calibration.json").read_text().lower()


def test_a_line_cut_short_at_the_end_is_survived(csv_pass):
    directory = csv_pass(2)
    text = (directory / "gyro.csv").read_text()
    (directory / "gyro.csv").write_text(text[:-30])
    result = run("inspect", directory)
    assert result.returncode == TRUSTWORTHY
    assert "cut short" in result.stdout


@pytest.mark.parametrize("edit, words", [
    (lambda text: text.replace("period_s = 0.125", ""), ("period_s",)),
    (lambda text: text.replace("readout_noise_rad", "readout_noise"), ("readout_noise", "readout_noise_rad")),
    (lambda text: text.replace("[gyro]", "[gyros]"), ("gyros",)),
    (lambda text: text + "\n[oven]\nheat = 3\n", ("oven",)),
])
def test_missing_and_unknown_keys_are_named_with_their_place(csv_pass, edit, words):
    refused(run("inspect", csv_pass(2, toml_edit=edit)), INPUT_REFUSED, "pass.toml", *words)


def test_a_field_that_is_no_number_is_named_with_line_and_column(csv_pass):
    directory = csv_pass(2)
    edit_lines(directory / "gyro.csv", lambda lines: lines.__setitem__(5, "0.500,oops,0,0,1,0,0\n"))
    refused(run("inspect", directory), INPUT_REFUSED, "gyro.csv:6:7")


@pytest.mark.parametrize("config, word", [
    ("[filter]\ndirection_random_walk = 1e-8\n", "unit"),
    ("[filter]\ngate = 3\n", "gate_nis"),
    ("[filter]\ngate_nis = -1\n", "gate_nis"),
    ("[filter]\nreopen_after_rejections = 0.5\n", "reopen_after_rejections"),
    ("[filter]\nreopen_after_jump_rejections = 0\n", "reopen_after_jump_rejections"),
    ("[filter]\nstudent_t_freedom = -1.0\n", "student_t_freedom"),
    ("[filter]\nangles_after = \"0s\"\n", "angles_after"),
    ("[filter]\nangles_after = 60\n", "angles_after"),
    ("[further_states]\nclock_offset = 1\n", "clock_offset"),
    ("[further_states]\nreadout_bias = \"1arcsec\"\n", "readout_bias"),
    ("[further_states]\norbital_error = \"perhaps\"\n", "orbital_error"),
    ("[further_states]\nwandering_drift = \"-1e-8rad/s\"\n", "wandering_drift"),
    ("[further_states]\nwandering_time = \"0h\"\n", "wandering_time"),
    ("[corrections]\ninterval = 90\n", "interval"),
    ("[corrections]\ninterval = \"-5min\"\n", "interval"),
    ("estimator = \"magic\"\n", "magic"),
    ("need = \"5arcmin\"\n", "5arcmin for 270min"),
    ("need = 5\n", "need"),
])
def test_bad_settings_are_refused(tmp_path, config, word):
    file = tmp_path / "config.toml"
    file.write_text(config)
    refused(run("calibrate", EXAMPLE, "-o", tmp_path / "out", "--config", file), INPUT_REFUSED, word)


def test_an_attitude_of_another_time_is_refused(tmp_path):
    file = tmp_path / "attitude.csv"
    file.write_text("t_s,q_x,q_y,q_z,q_w\n1e6,0,0,0,1\n")
    refused(run("evaluate", EXAMPLE, "--attitude", file), INPUT_REFUSED, "attitude.csv", "no epoch in common")


# A machine that fails.


def test_an_output_directory_that_cannot_be_made_is_a_machine_failure(tmp_path):
    (tmp_path / "file").write_text("")
    refused(run("calibrate", EXAMPLE, "-o", tmp_path / "file" / "out", "--estimator", "paper"), MACHINE_FAILED, "out")


def test_a_full_disk_leaves_no_half_written_file(csv_pass, tmp_path):
    out = tmp_path / "out"

    def limit():  # writes past 100 kB fail, as on a full disk
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    result = run("calibrate", csv_pass(), "-o", out, "--estimator", "paper", preexec_fn=limit)
    refused(result, MACHINE_FAILED, "out")
    assert ".trihedron" not in result.stderr
    assert not out.exists()


def test_an_output_that_cannot_be_printed_is_a_machine_failure():
    with open("/dev/full", "w") as full:
        result = subprocess.run([str(PROGRAM), "inspect", str(EXAMPLE)], stdout=full, stderr=subprocess.PIPE, text=True)
    assert result.returncode == MACHINE_FAILED
    assert "standard output" in result.stderr


def test_a_truth_of_another_number_of_gyros_is_refused(csv_pass):
    directory = csv_pass(2)
    gyro = '{"drift_rad_s": [0, 0, 0, 0, 0, 0, 0], "lambda_rad": [0, 0, 0], "unmodelled_rad_s": [0, 0, 0, 0, 0, 0]}'
    (directory / "truth.json").write_text('{"gyros": [%s]}' % ", ".join([gyro] * 3))
    (directory / "truth.csv").write_text("t_s,q_x,q_y,q_z,q_w,h1_x,h1_y,h1_z,h2_x,h2_y,h2_z,h3_x,h3_y,h3_z\n0,0,0,0,1,1,0,0,0,1,0,0,0,1\n")
    (directory / "attitude.csv").write_text("t_s,q_x,q_y,q_z,q_w\n0,0,0,0,1\n")
    refused(run("evaluate", directory, "--attitude", directory / "attitude.csv"), INPUT_REFUSED, "3 gyros")


@pytest.mark.parametrize("name", ["truth.csv", "truth.json"])
def test_a_truth_of_which_a_part_is_missing_keeps_no_pass_from_being_calibrated(csv_pass, tmp_path, name):
    directory = csv_pass(30)
    without = run("--json", "calibrate", directory, "-o", tmp_path / "without", "--estimator", "paper")
    (directory / name).write_text("t_s,q_x,q_y,q_z,q_w\n0,0,0,0,1\n" if name == "truth.csv" else '{"gyros": []}')
    said = run("calibrate", directory, "-o", tmp_path / "out", "--estimator", "paper")
    assert said.returncode == without.returncode
    assert "truth that is not whole, nothing is compared with it" in said.stdout
    assert (tmp_path / "out/calibration.json").read_text() == (tmp_path / "without/calibration.json").read_text()
    flown = run("navigate", directory, "--prior", "-o", tmp_path / "attitude.csv")
    assert "truth that is not whole" in flown.stdout


def test_a_read_only_directory_is_a_machine_failure():
    refused(run("calibrate", EXAMPLE, "-o", "/proc/trihedron", "--estimator", "paper"), MACHINE_FAILED, "/proc/trihedron")


# Eighty minutes without a slew, both momenta near the orbit plane, and the simplest calibration of it.
STEADY = """
[scenario]
seed = 2
duration = "80min"
[attitude]
slews = {slews}
[gyro.drift]
outside_sigma = "0rad/s"
[[gyro.unit]]
start_direction_c = [0.995, 0.085, 0.043]
[[gyro.unit]]
start_direction_c = [0.050, 0.124, 0.991]
"""


@pytest.fixture
def observe(tmp_path):
    """Runs `observe` on the steady flight, with these slews, or on something else."""

    def go(*arguments, slews='"none"', of=None, duration="80min"):
        (tmp_path / "told.toml").write_text(TOLD)
        (tmp_path / "steady.toml").write_text(STEADY.replace("{slews}", slews).replace("80min", duration))
        return run("observe", of or tmp_path / "steady.toml", "--config", tmp_path / "told.toml", *arguments)

    return go


def test_observe_names_what_steady_flight_cannot_tell(observe):
    result = observe()
    assert result.returncode == DO_NOT_USE
    assert "Unobservable" in result.stdout and "z1 adds" in result.stdout and "--advise" in result.stdout
    for gyro in (1, 2):
        assert f"gyro {gyro} alignment about the orbit normal, against its initial direction" in result.stdout
    told = result.stdout
    result = observe("--json")
    assert result.returncode == DO_NOT_USE
    summary = json.loads(result.stdout)
    unobservable = sum(combination["unobservable"] for combination in summary["combinations"])
    assert unobservable > 0 and told.startswith(f"Observable  {20 - unobservable} of 20 combinations of parameters: ")
    assert "  z1 adds: 1σ by the readings at the fixes alone over " in told
    assert [c["harmful"] for c in summary["combinations"] if c["unobservable"]] == [True, True]
    assert summary["rank"] == len(summary["parameters"]) == 20
    for parameter in summary["parameters"]:
        assert parameter["sigma"] == parameter["sigma_until"][-1] < parameter["prior_sigma"]
        assert parameter["angle_gain"] >= 1
    assert len(summary["t_s"]) == len(summary["parameters"][0]["sigma_until"]) == 20
    assert summary["t_s"][-1] == 4800
    result = observe("--quiet")
    assert (result.returncode, result.stdout) == (DO_NOT_USE, "")


@pytest.mark.long
def test_observe_finds_nothing_missing_in_a_pass_with_slews(observe):
    result = observe(of=EXAMPLE)
    assert result.returncode == TRUSTWORTHY
    assert "Unobservable" not in result.stdout


@pytest.mark.long
def test_advice_can_be_pasted_and_is_confirmed(observe):
    result = observe("--advise", "--slews", "1", "--manoeuvre-time", "8min", "--max-angle", "20deg", "--max-rate", "0.4deg/s",
                     "--confirm", "2", duration="50min")
    assert result.returncode == TRUSTWORTHY
    assert "by 2 simulated flights" in result.stdout
    assert 'max_slew_rate = "0.4deg/s"' in result.stdout
    slews = result.stdout.split("slews = ")[1].split("]")[0] + "]"
    assert observe(slews=slews, duration="50min").returncode == TRUSTWORTHY

    result = observe("--json", "--advise", "--slews", "1", "--manoeuvre-time", "8min", "--confirm", "2", duration="50min")
    assert result.returncode == TRUSTWORTHY
    advice = json.loads(result.stdout)["advice"]
    assert len(advice["slews"]) == 2
    assert advice["attitude_error_rad"]["after"] < advice["attitude_error_rad"]["before"] / 100
    assert len(advice["combinations"]) == 2
    for combination in advice["combinations"]:
        assert combination["sigma_after"] < combination["sigma_before"] / 100
        assert combination["sigma_simulated"] > 0
    assert advice["confirmation"]["runs"] == 2 and not advice["confirmation"]["contradicted"]


def test_flights_that_contradict_a_plan_are_told(observe, tmp_path):
    flown = STEADY.replace("{slews}", '"none"').replace('outside_sigma = "0rad/s"', 'outside_sigma = "1e-7rad/s"')
    (tmp_path / "flown.toml").write_text(flown)
    result = observe("--advise", "--slews", "1", "--manoeuvre-time", "8min", "--confirm", "2", of=tmp_path / "flown.toml")
    assert result.returncode == DO_NOT_USE and "The flights CONTRADICT the prediction" in result.stdout


@pytest.mark.parametrize("limit, value, cure", [
    ("--manoeuvre-time", "1s", "Give a longer --manoeuvre-time than 1s: a slew of 30deg, there and back, takes "),
    ("--max-angle", "0.01deg", "Give a larger --max-angle than 0.01deg."),
])
def test_where_no_slew_helps_the_advice_says_which_limit_to_widen(observe, limit, value, cure):
    result = observe("--advise", limit, value, "--confirm", "2")
    assert result.returncode == DO_NOT_USE
    advice = result.stdout.split("\nAdvice ")[1]
    assert "smaller by 5 %" in advice and cure in advice and "begin = " not in advice and "Confirmed" not in advice
    advice = json.loads(observe("--json", "--advise", limit, value).stdout)["advice"]
    assert advice["slews"] == [] and cure in advice["why_no_slews"]
    assert advice["attitude_error_rad"]["after"] == advice["attitude_error_rad"]["before"]


def test_a_flight_that_needs_no_slews_is_not_told_to_widen_a_limit(observe, tmp_path):
    known = STEADY.replace("{slews}", '"none"').replace('outside_sigma = "0rad/s"', 'outside_sigma = "0rad/s"\nprior_sigma = "1e-12rad/s"')
    (tmp_path / "known.toml").write_text(known.replace("[gyro.drift]", '[gyro]\nalignment_prior_sigma = "1arcsec"\n[gyro.drift]'))
    for limit in (("--max-angle", "0.01deg"), ("--manoeuvre-time", "1s")):
        result = observe("--advise", *limit, of=tmp_path / "known.toml")
        assert "The flight needs none" in result.stdout and "Give a " not in result.stdout


def test_observe_refuses(observe, tmp_path):
    refused(observe("--advise", of=EXAMPLE), WRONG_USAGE, "scenario", "recorded", 'slews = "none"')
    refused(observe("--confirm", "2"), WRONG_USAGE, "--advise")
    refused(observe("--advise", "--max-angle", "30"), WRONG_USAGE, "unit")
    refused(observe("--advise", "--slews", "0"), WRONG_USAGE, "--slews")
    refused(observe("--advise", slews='[{begin = "10min", roll = "5deg"}]'), INPUT_REFUSED, "slews of its own", "none")
    refused(observe("--advise", "--manoeuvre-time", "1h"), INPUT_REFUSED, "no room")
    refused(observe(of=tmp_path / "nothing"), INPUT_REFUSED, "nothing")
    refused(observe(of=tmp_path / "nothing.toml"), INPUT_REFUSED, "nothing.toml")
    (tmp_path / "blind.toml").write_text(STEADY.replace("{slews}", '"none"') + '[star_tracker]\ndropout_probability = 1\n')
    refused(observe(of=tmp_path / "blind.toml"), INPUT_REFUSED, "no fix", "there is none")
    (tmp_path / "parallel.toml").write_text(STEADY.replace("{slews}", '"none"').replace("[0.050, 0.124, 0.991]", "[0.995, 0.085, 0.043]"))
    refused(observe(of=tmp_path / "parallel.toml"), INPUT_REFUSED, "momenta nearly parallel", "start the rotors along other directions")
    refused(observe("--advise", of=tmp_path / "blind.toml"), INPUT_REFUSED, "no fix")
