"""`campaign`: what is refused before the work, runs that can be repeated alone, kills and stops. Run by CTest with TRIHEDRON_BUILD naming the
build directory."""
import json
import os
import pty
import re
import shlex
import shutil
import signal
import subprocess
import time
import zlib

import jsonschema
import numpy
import pytest
import xarray

from program import DO_NOT_USE, INPUT_REFUSED, PROGRAM, ROOT, TRUSTWORTHY, WRONG_USAGE, refused, run

# Twelve runs of five minutes with nothing left to decide: a hundredth of a second each.
CAMPAIGN = """
[campaign]
name = "Test"
repeats = 2
seed = 5
[base.scenario]
duration = "5min"
[calibration]
drift_model = "esg7"
[calibration.filter]
noise = "told"
[calibration.further_states]
clock_offset = "off"
orbital_error = "off"
readout_bias = "off"
coefficient_change = "off"
wandering_drift = "off"
[vary]
gyro.readout.noise = {grid = ["1arcsec", "2arcsec", "4arcsec"]}
star_tracker.dropout_probability = {grid = [0, 0.1]}
attitude.reference = {choice = ["orbital", "yaw-steered"]}
gyro.misalignment_magnitude = {normal = ["20arcmin", "5arcmin"], min = "1arcmin"}
"""
# Of the filter alone: drift of eq. (1), so that runs go side by side, and a grid over what makes some of them go by themselves.
FILTERS = """
[campaign]
name = "Filters"
repeats = 10
seed = 5
work = "filter"
[base.scenario]
duration = "10min"
[base.gyro.drift]
outside_sigma = "0rad/s"
[vary]
star_tracker.period = {grid = ["3s", "1s"]}
star_tracker.dropout_probability = {choice = [0, 0.1]}
"""
# Long enough that a test is not late to end it, on a busy machine as well.
LONG_CAMPAIGN = CAMPAIGN.replace("repeats = 2", "repeats = 20")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    directory = tmp_path_factory.mktemp("campaign")
    (directory / "c.toml").write_text(CAMPAIGN)
    result = run("campaign", directory / "c.toml", "-o", directory / "out", "--jobs", "1")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    assert not result.stderr
    assert "Test: 12 runs" in result.stdout
    return directory


def flown(directory, campaign):
    """The directory, with the campaign and what one process makes of it, and its exit status."""
    (directory / "c.toml").write_text(campaign)
    result = run("--quiet", "campaign", directory / "c.toml", "-o", directory / "out")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    return directory, result.returncode


@pytest.fixture(scope="module")
def long_one(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("long"), LONG_CAMPAIGN)


def table(out):
    return (out / "runs.nc").read_bytes()


def records(out):
    return (out / "runs.journal").read_text().count("\n") - 1


def until(journal, count, process):
    """The journal has so many runs."""
    for _ in range(4000):
        if journal.exists() and journal.read_text().count("\n") > count:
            return
        assert process.poll() is None
        time.sleep(0.005)
    pytest.fail("no run came to its end")


def test_the_table_is_the_same_on_any_number_of_threads(finished):
    (finished / "two").mkdir()
    (finished / "two" / "runs.journal").touch()  # as a kill at the very beginning leaves it
    result = run("--quiet", "campaign", finished / "c.toml", "-o", finished / "two", "--jobs", "2")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE)
    assert table(finished / "two") == table(finished / "out")


def test_the_table_is_read_by_xarray(finished):
    with xarray.open_dataset(finished / "out" / "runs.nc") as runs:
        assert dict(runs.sizes) == {"run": 12, "gyro": 2, "axis": 3, "coefficient": 7, "quantile": 4}
        assert list(runs.run) == list(range(12))
        assert list(runs.coefficient.values[:2]) == ["k0", "mu12"]
        assert (runs.nees_degrees_of_freedom == 20).all()
        assert runs.alignment_error.dims == ("run", "gyro", "axis") and runs.alignment_error.attrs["units"] == "rad"
        assert sorted(set(runs.input_gyro_readout_noise.values)) == [1, 2, 4]
        assert runs.input_gyro_readout_noise.attrs["units"] == "arcsec"
        assert runs.input_gyro_readout_noise.attrs["key"] == "gyro.readout.noise"
        assert set(runs.input_attitude_reference.values) <= {"orbital", "yaw-steered"}
        assert list(runs.outcome.attrs["flag_values"]) == [0, 1, 2]
        # By the definition in its long_name, from the errors and sigmas beside it where nothing is correlated: not less than any of them.
        largest = (abs(runs.alignment_error / runs.alignment_sigma)).max(["gyro", "axis"])
        assert (runs.nees >= largest**2 * (1 - 1e-9)).all()


@pytest.mark.long
def test_a_kill_loses_no_finished_run_and_repeats_none(long_one):
    directory, status = long_one
    out = directory / "killed"
    process = subprocess.Popen([PROGRAM, "campaign", directory / "c.toml", "-o", out, "--jobs", "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until(out / "runs.journal", 3, process)
    process.kill()
    process.wait()
    kept = (out / "runs.journal").read_text()
    kept = kept[: kept.rindex("\n") + 1]
    assert not (out / "runs.nc").exists()
    with open(out / "runs.journal", "a") as journal:
        journal.write('12345678 {"run": ')  # as a write that was cut short
    result = run("--quiet", "campaign", directory / "c.toml", "-o", out, "--resume", "--jobs", "2")
    assert result.returncode == status, result.stderr
    assert (out / "runs.journal").read_text().startswith(kept)
    assert records(out) == 120
    assert table(out) == table(directory / "out")
    times = (out / "times.csv").read_text()
    assert run("--quiet", "campaign", directory / "c.toml", "-o", out, "--resume").returncode == status  # nothing is left to do
    assert (out / "times.csv").read_text() == times


def test_a_record_that_is_damaged_is_performed_again_and_the_others_stay(finished):
    out = finished / "damaged"
    run("--quiet", "campaign", finished / "c.toml", "-o", out)
    lines = (out / "runs.journal").read_text().split("\n")
    lines[4] = lines[4].replace('"outcome":', '"outcomE":')
    (out / "runs.journal").write_text("\n".join(lines))
    result = run("--quiet", "campaign", finished / "c.toml", "-o", out, "--resume")
    assert "1 run is damaged, performed again" in result.stderr
    assert records(out) == 13
    assert not run("--quiet", "campaign", finished / "c.toml", "-o", out, "--resume").stderr
    assert table(out) == table(finished / "out")


def test_a_journal_that_is_cut_short_in_its_first_line_holds_no_run(finished):
    out = finished / "begun"
    out.mkdir()
    head = (finished / "out" / "runs.journal").read_bytes().split(b"\n")[0]
    for size in (0, 1, 300, len(head)):
        (out / "runs.journal").write_bytes(head[:size])
        assert run("--quiet", "campaign", finished / "c.toml", "-o", out, "--resume").returncode in (TRUSTWORTHY, DO_NOT_USE)
        assert table(out) == table(finished / "out")
    (out / "runs.journal").write_bytes(head[:300] + b"?")
    refused(run("campaign", finished / "c.toml", "-o", out, "--resume"), INPUT_REFUSED, "no journal")
    (out / "runs.journal").unlink()
    (out / "runs.journal").mkdir()
    result = run("campaign", finished / "c.toml", "-o", out, "--resume")
    assert result.returncode == INPUT_REFUSED and "runs.journal" in result.stderr and "filesystem error" not in result.stderr


@pytest.mark.parametrize("with_signal", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_a_stop_keeps_what_is_finished_and_says_how_to_go_on(long_one, tmp_path, with_signal):
    directory, _ = long_one
    out = tmp_path / "out"
    process = subprocess.Popen([PROGRAM, "campaign", directory / "c.toml", "-o", out, "--jobs", "1"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(out / "runs.journal", 2, process)
    process.send_signal(with_signal)
    _, said = process.communicate(timeout=60)
    assert process.returncode == -with_signal
    assert "runs are kept: go on with trihedron campaign" in said and said.endswith("--resume\n")
    assert sorted(os.listdir(out)) == ["runs.journal"]
    run("--quiet", "campaign", directory / "c.toml", "-o", out, "--resume")
    assert table(out) == table(directory / "out")


def test_a_run_alone_is_that_of_the_campaign(finished):
    result = run("campaign", finished / "c.toml", "-o", finished / "out", "--only", "7")
    assert "the same result, bit for bit" in result.stdout
    alone = finished / "out" / "run-7"
    assert sorted(os.listdir(alone)) == ["attitude.csv", "calibration.json", "effective-config.toml", "pass.nc", "report.html", "residuals.nc",
                                         "run.json", "scenario.toml"]
    with xarray.open_dataset(finished / "out" / "runs.nc") as runs:
        row = runs.sel(run=7)
        values = json.loads((alone / "run.json").read_text())["values"]
        assert values["nees"] == [float(row.nees)]
        assert values["alignment_error"] == list(row.alignment_error.values.ravel())
    # And without the campaign: from the scenario that is beside it.
    assert run("--quiet", "simulate", alone / "scenario.toml", "-o", finished / "again.nc").returncode == TRUSTWORTHY
    for group in ("gyro", "star_tracker", "truth"):
        with xarray.open_dataset(finished / "again.nc", group=group) as again, xarray.open_dataset(alone / "pass.nc", group=group) as written:
            assert again.equals(written)
    shown = json.loads(run("--json", "campaign", finished / "c.toml", "--only", "7").stdout)
    assert shown["values"]["nees"] == values["nees"]


def test_the_worst_run_is_repeated_by_the_command_that_is_shown(finished):
    result = run("--json", "campaign", finished / "c.toml", "-o", finished / "out", "--resume")
    command = json.loads(result.stdout)["worst"][0]["command"].split()
    assert command[0] == "trihedron"
    assert "bit for bit" in run(*command[1:]).stdout


def schema(name):
    return json.loads(run("schema", name).stdout)


def test_outputs_are_as_their_schemas_say(finished):
    campaign = json.loads(run("--json", "campaign", finished / "c.toml", "-o", finished / "out", "--resume").stdout, parse_constant=pytest.fail)
    jsonschema.validate(campaign, schema("campaign-output"))
    assert campaign["runs"] == 12 and sum(campaign["outcomes"].values()) == 12
    alone = json.loads(run("--json", "campaign", finished / "c.toml", "--only", "3").stdout, parse_constant=pytest.fail)
    jsonschema.validate(alone, schema("campaign-run-output"))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**campaign, "more": 1}, schema("campaign-output"))


def test_a_run_that_is_replayed_does_not_replace_the_scenario_of_its_campaign(tmp_path):
    base = tmp_path / "out" / "run-0" / "scenario.toml"
    base.parent.mkdir(parents=True)
    base.write_text('# looked at\n[scenario]\nduration = "5min"\n')
    (tmp_path / "campaign.toml").write_text('base = "out/run-0/scenario.toml"\n' + CAMPAIGN.replace('[base.scenario]\nduration = "5min"\n', ""))
    refused(run("campaign", tmp_path / "campaign.toml", "-o", tmp_path / "out", "--only", "0"), WRONG_USAGE, "scenario.toml")
    assert base.read_text().startswith("# looked at")


def test_progress_with_its_rate_goes_to_a_terminal_only(finished, tmp_path):
    master, slave = pty.openpty()
    process = subprocess.Popen([PROGRAM, "campaign", finished / "c.toml", "-o", tmp_path / "out"], stdout=subprocess.DEVNULL, stderr=slave)
    os.close(slave)
    shown = b""
    while True:
        try:
            more = os.read(master, 4096)
        except OSError:  # the other end is closed
            break
        if not more:
            break
        shown += more
    os.close(master)
    assert process.wait(timeout=60) in (TRUSTWORTHY, DO_NOT_USE)
    assert b"6/12" in shown and b"runs/s" in shown and b"left" in shown
    assert shown.endswith(b"\r\x1b[K")


def test_runs_that_fail_are_rows_and_the_exit_status_says_so(tmp_path):
    text = CAMPAIGN.replace("grid = [0, 0.1]", "grid = [0, 1]")
    (tmp_path / "c.toml").write_text(text)
    result = run("campaign", tmp_path / "c.toml", "-o", tmp_path / "out")
    assert result.returncode == DO_NOT_USE
    assert "6 failed" in result.stdout and "runs-failed" in result.stdout
    with xarray.open_dataset(tmp_path / "out" / "runs.nc") as runs:
        failed = runs.outcome == 2
        assert int(failed.sum()) == 6
        assert (runs.input_star_tracker_dropout_probability[failed] == 1).all()
        assert all("no fix" in reason for reason in runs.reason[failed].values)
        assert runs.nees[failed].isnull().all()
    report = (tmp_path / "out" / "report.html").read_text()
    assert "6 of 12 runs failed" in report
    assert run("campaign", tmp_path / "c.toml", "--only", "2").returncode == DO_NOT_USE


# Settings that differ over the same flights, and a value that follows another.
SETTINGS = CAMPAIGN.replace('attitude.reference = {choice = ["orbital", "yaw-steered"]}', """
calibration.estimator = {grid = ["paper", "invariant"]}
attitude = {grid = [{}, {reference = "yaw-steered"}], names = ["along track", "yaw-steered"]}
gyro.alignment_prior_sigma = {of = "gyro.misalignment_magnitude", times = 0.5}
gyro.drift.direction_walk = {choice = ["2e-8rad/s^0.5", "5e-8rad/s^0.5"]}
calibration.filter.direction_random_walk = {of = "gyro.drift.direction_walk"}
""")


def test_settings_of_a_grid_are_tried_over_the_same_flights(tmp_path):
    (tmp_path / "c.toml").write_text(SETTINGS)
    out = tmp_path / "out"
    shown = json.loads(run("--quiet", "--json", "campaign", tmp_path / "c.toml", "-o", out).stdout)
    with xarray.open_dataset(out / "runs.nc") as runs:
        assert runs.sizes["run"] == 48
        paper, invariant = runs.isel(run=slice(0, 24)), runs.isel(run=slice(24, 48))
        assert set(paper.input_calibration_estimator.values) == {"paper"} and set(invariant.input_calibration_estimator.values) == {"invariant"}
        assert len(set(paper.seed.values)) == 24
        for name in ("seed", "input_gyro_readout_noise", "input_gyro_misalignment_magnitude", "input_attitude"):
            assert (paper[name].values == invariant[name].values).all()
        assert (paper.nees.values != invariant.nees.values).all()
        assert (runs.input_gyro_alignment_prior_sigma == runs.input_gyro_misalignment_magnitude / 2).all()
        assert (runs.input_calibration_filter_direction_random_walk == runs.input_gyro_drift_direction_walk).all()
        trusted = runs.where(runs.outcome == 0)
        for cell in shown["cells"]:
            here = trusted.where((runs.input_calibration_estimator == cell["values"]["calibration.estimator"]) &
                                 (runs.input_attitude == cell["values"]["attitude"]) &
                                 (runs.input_gyro_readout_noise == float(cell["values"]["gyro.readout.noise"].removesuffix("arcsec"))) &
                                 (runs.input_star_tracker_dropout_probability == float(cell["values"]["star_tracker.dropout_probability"])))
            assert int(here.nees.count()) == cell["outcomes"]["trustworthy"]
            if cell["nees"] is not None:
                assert cell["nees"]["mean"] == pytest.approx(float(here.nees.mean()), rel=1e-12)
    assert len(shown["cells"]) == 24 and shown["cells"][0]["values"].keys() == {
        "attitude", "calibration.estimator", "gyro.readout.noise", "star_tracker.dropout_probability"}
    shown = run("campaign", tmp_path / "c.toml", "-o", out, "--resume").stdout
    assert "By the grid" in shown and "along track" in shown
    assert re.search(r"NEES +NIS +alignment error +open loop error +extension\n", shown)
    alone = run("campaign", tmp_path / "c.toml", "-o", out, "--only", "30")
    assert "bit for bit" in alone.stdout
    assert 'estimator = "invariant"' in (out / "run-30" / "effective-config.toml").read_text()
    walk = json.loads((out / "run-30" / "run.json").read_text())["draws"]["gyro.drift.direction_walk"]
    assert f'direction_random_walk = "{walk}"' in (out / "run-30" / "effective-config.toml").read_text()


def lose(journal, lost):
    """The journal as it is where this run has ended its process again and again."""
    lines = journal.read_text().splitlines()
    for number, line in enumerate(lines[1:], 1):
        record = json.loads(line[9:])
        if record["run"] == lost:
            record.update(outcome=2, reason="ended its process 2 times, at last by signal 9")
            text = json.dumps(record, separators=(",", ":"))
            lines[number] = f"{zlib.crc32(text.encode()):08x} {text}"
    journal.write_text("\n".join(lines) + "\n")


def test_a_run_that_was_lost_with_its_process_is_performed_alone(finished, tmp_path):
    shutil.copytree(finished / "out", tmp_path / "out")
    journal = tmp_path / "out" / "runs.journal"
    lose(journal, 7)
    result = run("campaign", finished / "c.toml", "-o", tmp_path / "out", "--only", "7")
    assert result.returncode in (TRUSTWORTHY, DO_NOT_USE), result.stderr
    assert "failed there: ended its process 2 times" in result.stdout
    assert (tmp_path / "out" / "run-7" / "report.html").exists()
    before = journal.read_text()
    run("--quiet", "campaign", finished / "c.toml", "-o", tmp_path / "out", "--resume")
    assert journal.read_text() == before  # it might take the others with it
    with open(journal, "a") as file:
        file.write(next(line for line in (finished / "out" / "runs.journal").read_text().splitlines() if json.loads(line[9:]).get("run") == 7) + "\n")
    run("--quiet", "campaign", finished / "c.toml", "-o", tmp_path / "out", "--resume")
    assert table(tmp_path / "out") == table(finished / "out")  # the later record counts


def test_commands_are_shown_as_a_shell_takes_them(finished, tmp_path):
    directory = tmp_path / "it's here"
    directory.mkdir()
    shutil.copy(finished / "c.toml", directory / "c d.toml")
    result = run("campaign", directory / "c d.toml", "-o", directory / "out")
    command = result.stdout.split("each again by: trihedron ")[1].split("\n")[0]
    assert shlex.split(command)[:4] == ["campaign", str(directory / "c d.toml"), "-o", str(directory / "out")]


def test_dates_and_words_that_begin_with_a_digit_are_words(tmp_path):
    epochs = ["2009-05-20T00:00:00", "2010-05-20T00:00:00"]
    (tmp_path / "c.toml").write_text(FILTERS.replace("repeats = 10", "repeats = 1") + f"scenario.epoch_tai = {{grid = {epochs}}}\n"
                                     'scenario.spacecraft = {choice = ["1st", "2nd"]}\n')
    assert run("--quiet", "campaign", tmp_path / "c.toml", "-o", tmp_path / "out").returncode == TRUSTWORTHY
    with xarray.open_dataset(tmp_path / "out" / "runs.nc") as runs:
        assert sorted({str(word) for word in runs.input_scenario_epoch_tai.values}) == epochs


def test_draws_that_are_possible_together_alone_are_taken(tmp_path):
    together = 'orbit.perigee_altitude = {uniform = ["700km", "800km"]}\norbit.apogee_altitude = '
    for apogee in ('{uniform = ["800km", "900km"]}', '{of = "orbit.perigee_altitude"}'):
        (tmp_path / "c.toml").write_text(FILTERS + together + apogee + "\n")
        assert run("--quiet", "campaign", tmp_path / "c.toml", "--only", "3").returncode == TRUSTWORTHY
    (tmp_path / "c.toml").write_text(FILTERS + together + '{uniform = ["600km", "900km"]}\n')
    refused(run("campaign", tmp_path / "c.toml", "--only", "3"), INPUT_REFUSED, "apogee_altitude", "can be drawn")


def test_covariances_are_kept_where_they_are_asked_for(finished, tmp_path):
    (tmp_path / "c.toml").write_text(CAMPAIGN.replace("seed = 5", 'seed = 5\ncovariance = "kept"'))
    run("--quiet", "campaign", tmp_path / "c.toml", "-o", tmp_path / "out")
    with xarray.open_dataset(tmp_path / "out" / "runs.nc") as runs, xarray.open_dataset(finished / "out" / "runs.nc") as without:
        assert "covariance" not in without and (runs.nees == without.nees).all()
        assert list(runs.parameter.values[[0, 7, 10, 19]]) == ["gyro1.k0", "gyro1.align_x", "gyro2.k0", "gyro2.align_z"]
        for number in runs.run.values:
            one = runs.sel(run=number)
            errors = numpy.concatenate([one.drift_error.values, one.alignment_error.values], axis=1).ravel()
            sigmas = numpy.concatenate([one.drift_sigma.values, one.alignment_sigma.values], axis=1).ravel()
            assert numpy.sqrt(numpy.diag(one.covariance)) == pytest.approx(sigmas, rel=1e-14)
            scaled = one.covariance.values / numpy.outer(sigmas, sigmas)
            assert (errors / sigmas) @ numpy.linalg.solve(scaled, errors / sigmas) == pytest.approx(float(one.nees), rel=1e-6)
    alone = run("campaign", tmp_path / "c.toml", "-o", tmp_path / "out", "--only", "1")
    assert "bit for bit" in alone.stdout


def test_runs_of_filters_are_the_same_together_and_alone(tmp_path):
    (tmp_path / "c.toml").write_text(FILTERS)
    text = run("campaign", tmp_path / "c.toml", "-o", tmp_path / "one", "--jobs", "1").stdout
    assert "20 trustworthy" in text and "NEES" in text and "Correction interval" not in text and "settled" not in text
    run("--quiet", "campaign", tmp_path / "c.toml", "-o", tmp_path / "two", "--jobs", "2")
    page = (tmp_path / "one" / "report.html").read_text()
    shown = page[page.index("<main"):page.index("</main")]
    assert "the filter alone" in page and "Attitude of the calibration, rms" in shown and "extension" not in shown.lower()
    assert table(tmp_path / "one") == table(tmp_path / "two")
    with xarray.open_dataset(tmp_path / "one" / "runs.nc") as runs:
        assert "open_loop_error" not in runs and (runs.nees > 0).all() and (runs.nees_degrees_of_freedom == 20).all()
    # Some runs are lost: those that are flown again have other company.
    journal = tmp_path / "two" / "runs.journal"
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(line for i, line in enumerate(lines) if i in (0, 3, 4, 9, 15)))
    run("--quiet", "campaign", tmp_path / "c.toml", "-o", tmp_path / "two", "--resume")
    assert table(tmp_path / "one") == table(tmp_path / "two")
    # One alone, and what the command makes of its flight beside it.
    assert "bit for bit" in run("campaign", tmp_path / "c.toml", "-o", tmp_path / "one", "--only", "4").stdout
    assert (tmp_path / "one" / "run-4" / "report.html").exists()
    shown = json.loads(run("--json", "campaign", tmp_path / "c.toml", "--only", "13").stdout)
    with xarray.open_dataset(tmp_path / "one" / "runs.nc") as runs:
        assert shown["values"]["nees"] == [float(runs.nees.sel(run=13))]
    jsonschema.validate(json.loads(run("--json", "campaign", tmp_path / "c.toml", "-o", tmp_path / "one", "--resume").stdout), schema("campaign-output"))


# What is refused before the work.


def with_key(line):
    return CAMPAIGN + line + "\n"


@pytest.mark.parametrize("text, words", [
    (with_key('gyro.readout.nois = {uniform = ["1arcsec", "2arcsec"]}'), ["c.toml:23:", "did you mean \"noise\"", "gyro.readout.nois"]),
    (with_key('"gyro.readout.noisse" = {uniform = ["1arcsec", "2arcsec"]}'), ["c.toml:23:", "did you mean \"noise\""]),
    (with_key("gyro.readout.spike = {uniform = [1, 2]}"), ["c.toml:23:", "unit"]),
    (with_key('gyro.readout.spike = {uniform = ["1s", "2s"]}'), ["c.toml:23:", "angle", "arcsec"]),
    (with_key('gyro.readout.spike = {uniform = ["1arcsec", "2arcmin"]}'), ["c.toml:23:", "one unit"]),
    (with_key('gyro.readout.spike = {uniform = ["2arcsec", "1arcsec"]}'), ["c.toml:23:", "smaller number first"]),
    (with_key('gyro.readout.spike = {unifrom = ["1arcsec", "2arcsec"]}'), ["c.toml:23:", "did you mean \"uniform\""]),
    (with_key('gyro.readout.spike = {normal = ["1arcsec", "-2arcsec"]}'), ["c.toml:23:", "sigma"]),
    (with_key('gyro.readout.spike = {lognormal = ["1arcsec", "2arcsec"]}'), ["c.toml:23:", "factor"]),
    (with_key('gyro.readout.spike = {loguniform = ["0arcsec", "2arcsec"]}'), ["c.toml:23:", "logarithm"]),
    (with_key('gyro.readout.spike = {choice = ["0.1arcmin", "2arcsec"]}'), ["c.toml:23:", "arcmin", "in one unit"]),
    (with_key('gyro.readout.spike = {normal = ["1arcsec", "2arcsec"], min = "5arcmin"}'), ["c.toml:23:", "one unit"]),
    (with_key('gyro.readout.spike = {normal = ["1arcsec", "2arcsec"], min = "50arcsec"}'), ["c.toml:23:", "nothing can be drawn"]),
    (with_key('gyro.readout.spike = {uniform = ["1arcsec", "2arcsec"], min = "0arcsec"}'), ["c.toml:23:", "no meaning"]),
    (with_key('gyro.readout.spike = {uniform = ["1arcsec", "2arcsec"], choice = ["1arcsec"]}'), ["c.toml:23:", "two distributions"]),
    (with_key('gyro.readout.spike = {choice = ["1arcsec"], weights = [1, 2]}'), ["c.toml:23:", "weights"]),
    (with_key('gyro.readout.spike = {choice = ["1arcsec"], weights = [0]}'), ["c.toml:23:", "above zero"]),
    (with_key("gyro.readout.spike = {choice = []}"), ["c.toml:23:", "an empty list"]),
    (with_key('star_tracker.noise.0 = {uniform = ["1arcsec", "2arcsec"]}'), ["c.toml:23:", "elements are counted from 1"]),
    (with_key("gyro.readout.spike_probability = {uniform = [0.5, 2]}"), ["c.toml:23:", "outside 0 to 1"]),
    (with_key("gyro.readout.stuck_probability = {normal = [0.5, 0.2]}"), ["c.toml:23:", "min and max"]),
    (with_key("gyro.readout.spike = \"1arcsec\""), ["c.toml:23:", "no distribution"]),
    (with_key('"attitude.reference.x" = {choice = ["a"]}'), ["c.toml:23:", "same value"]),
    (with_key('gyro.unit.3.readout.noise = {uniform = ["1arcsec", "2arcsec"]}'), ["c.toml:23:", "unit", "base scenario"]),
    (with_key("scenario.seed = {choice = [1, 2]}"), ["c.toml:23:", "seed of its own"]),
    (with_key('"gyro.readout" = {choice = [{}]}'), ["c.toml", "same value"]),
    (with_key("calibration.estimater = {grid = [\"paper\"]}"), ["c.toml:23:", "did you mean \"estimator\""]),
    (with_key("calibration.estimator = {grid = [\"newspaper\"]}"), ["c.toml:23:", "newspaper", "can be drawn"]),
    (with_key('calibration.filter.direction_random_walk = {uniform = ["1s", "2s"]}'), ["c.toml:23:", "unit"]),
    (with_key('gyro.readout.spike = {of = "gyro.readout.nose"}'), ["c.toml:23:", "no numbers are drawn"]),
    (with_key('gyro.readout.spike = {of = "attitude.reference"}'), ["c.toml:23:", "no numbers are drawn"]),
    (with_key('gyro.readout.spike = {of = "gyro.readout.noise", times = "2arcsec"}'), ["c.toml:23:", "times"]),
    (with_key('gyro.readout.spike_probability = {of = "star_tracker.dropout_probability", times = 20}'), ["c.toml:23:", "can be drawn", "outside 0 to 1"]),
    (with_key('gyro.drift.direction_walk = {of = "calibration.filter.direction_random_walk"}\ncalibration.filter.direction_random_walk = {choice = ["1e-9rad/s^0.5", "1e-8rad/s^0.5"]}'),
     ["c.toml:23:", "follows a setting"]),
    (with_key('gyro.readout.spike = {uniform = ["1arcsec", "2arcsec"], times = 2}'), ["c.toml:23:", "no meaning"]),
    (with_key('gyro.readout.spike = {choice = ["1arcsec", "2arcsec"], names = ["small"]}'), ["c.toml:23:", "names"]),
    (with_key('gyro.readout.spike = {choice = ["1arcsec", "2arcsec"], names = ["small", "small"]}'), ["c.toml:23:", "small", "is there twice"]),
    (CAMPAIGN.replace('"orbital", "yaw-steered"', '"orbital", "orbital"'), ["orbital", "is there twice"]),
    (with_key("gyro.readout.spike_probability = {uniform = [0, inf]}"), ["c.toml:23:", "no finite number"]),
    (FILTERS.replace("[base.gyro.drift]", '[base.gyro]\nmisalignment = ["1arcmin", "2arcmin", "3arcmin"]\n[base.gyro.drift]') +
     'gyro.misalignment_magnitude = {uniform = ["1arcmin", "2arcmin"]}\n', ["c.toml:16:", "misalignment_magnitude", "has its size", "keep one of them"]),
    (CAMPAIGN.replace("repeats = 2", "runs = 10"), ["c.toml:4:", "grid", "repeats"]),
    (CAMPAIGN.replace("repeats = 2", "repeats = 0"), ["c.toml:4:", "repeats"]),
    (CAMPAIGN.replace("seed = 5", 'covariance = "yes"'), ["c.toml:5:", "kept"]),
    (CAMPAIGN.replace("seed = 5", 'work = "filtre"'), ["c.toml:5:", "did you mean \"filter\""]),
    (FILTERS + '[calibration]\nestimator = "batch"\n', ["batch is no filter", "invariant"]),
    (FILTERS + 'calibration.estimator = {grid = ["invariant", "batch"]}\n', ["c.toml:14:", "batch is no filter", "can be drawn"]),
    (CAMPAIGN.replace("repeats = 2", "repeat = 2"), ["c.toml:4:", "did you mean \"repeats\""]),
    (CAMPAIGN.replace("repeats = 2", "repeats = 1000000"), ["c.toml:2:", "6e+06 runs", "latin-hypercube"]),
    (with_key("\n".join(f'gyro.readout.{key} = {{grid = [{", ".join(["0"] * 100)}]}}' for key in
                        ("spike_probability", "stuck_probability")) + "\n" + "\n".join(
        f'star_tracker.{key} = {{grid = [{", ".join(["0"] * 100)}]}}' for key in ("outlier_probability", "wrong_sign_probability")) + "\n" +
        f'gyro.readout.dropout_probability = {{grid = [{", ".join(["0"] * 100)}]}}\ngyro.drift.warm_up_fraction = {{grid = [{", ".join(["0"] * 100)}]}}'),
     ["6e+12 points", "1000000", "latin-hypercube"]),
    (CAMPAIGN.replace("grid", "choice").replace("repeats = 2", "runs = 0"), ["c.toml:4:", "one run at least"]),
    (CAMPAIGN.replace("grid", "choice"), ["repeats", "runs"]),
    (CAMPAIGN.replace("grid", "choice").replace("repeats = 2", ""), ["runs", "missing"]),
    (CAMPAIGN.replace('duration = "5min"', 'duratio = "5min"'), ["c.toml:7:", "did you mean \"duration\""]),
    (CAMPAIGN.replace('drift_model = "esg7"', 'drift_model = "esg8"'), ["c.toml:9:", "esg7"]),
    ("base = \"nowhere.toml\"\n" + CAMPAIGN.replace('[base.scenario]\nduration = "5min"\n', ""), ["nowhere.toml"]),
    ("[campaign", ["c.toml:1:"]),
])
def test_a_campaign_that_cannot_be_is_refused_before_the_work(tmp_path, text, words):
    (tmp_path / "c.toml").write_text(text)
    refused(run("campaign", tmp_path / "c.toml", "-o", tmp_path / "out"), INPUT_REFUSED, *words)
    assert not (tmp_path / "out").exists()


def test_a_directory_of_another_campaign_is_refused_with_the_difference(finished, tmp_path):
    refused(run("campaign", finished / "c.toml", "-o", finished / "out"), INPUT_REFUSED, "12 of 12 runs", "--resume")
    before = table(finished / "out")
    for old, new, difference in (("seed = 5", "seed = 6", 'campaign.seed is "6", was "5"'), ('"4arcsec"', '"5arcsec"', "vary.gyro.readout.noise"),
                                 ("5min\"", "6min\"", 'base.scenario.duration is "6min", was "5min"'), ("esg7", "esg20", "calibration.drift_model")):
        (tmp_path / "c.toml").write_text(CAMPAIGN.replace(old, new))
        for arguments in ((), ("--resume",), ("--only", "1")):
            refused(run("campaign", tmp_path / "c.toml", "-o", finished / "out", *arguments), INPUT_REFUSED, "another campaign", difference)
    assert table(finished / "out") == before
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "runs.journal").write_text("notes\n")
    refused(run("campaign", finished / "c.toml", "-o", tmp_path / "out", "--resume"), INPUT_REFUSED, "runs.journal", "no journal")
    assert (tmp_path / "out" / "runs.journal").read_text() == "notes\n"


def test_wrong_usage(finished, tmp_path):
    campaign = finished / "c.toml"
    refused(run("campaign", campaign), WRONG_USAGE, "-o")
    refused(run("campaign", campaign, "--only", "12"), WRONG_USAGE, "0 to 11")
    refused(run("campaign", campaign, "--only", "-1"), WRONG_USAGE, "--only -1: the campaign has runs 0 to 11")
    refused(run("campaign", campaign, "--only", "9223372036854775807"), WRONG_USAGE, "--only 9223372036854775807: the campaign has runs 0 to 11")
    for no_run in ("9223372036854775808", "18446744073709551615", "-9223372036854775809", "7.5", "seven"):
        refused(run("campaign", campaign, "--only", no_run), WRONG_USAGE, f"--only: {no_run} is not the number of a run")
    refused(run("campaign", campaign, "-o", tmp_path / "out", "--jobs", "0"), WRONG_USAGE, "--jobs")
    refused(run("campaign", campaign, "-o", tmp_path / "out", "--resume", "--only", "1"), WRONG_USAGE, "--only")
    refused(run("campaign", campaign, "-o", campaign), WRONG_USAGE, "c.toml")


def test_the_example_is_a_campaign(tmp_path):
    result = run("--json", "campaign", ROOT / "examples" / "campaign.toml", "--only", "200")
    assert result.returncode == WRONG_USAGE and "0 to 199" in result.stderr
