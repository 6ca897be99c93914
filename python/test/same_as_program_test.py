"""What Python gives is what the program gives: files byte for byte, numbers bit for bit."""
import json
import shutil

import numpy as np
import pytest
import xarray as xr

import trihedron
from conftest import SCENARIO, program


def bits(values):
    """Of float64, so that NaN equals NaN and 0 does not equal -0."""
    return np.ascontiguousarray(values, dtype=np.float64).view(np.uint64)


def assert_same_bits(a, b):
    assert np.shape(a) == np.shape(b)
    np.testing.assert_array_equal(bits(a), bits(b))


def assert_same_tables(a, b):
    assert_same_bits(a.t_s.values, b.t_s.values)
    assert list(a.data_vars) == list(b.data_vars)
    for name in a.data_vars:
        assert_same_bits(a[name].values, b[name].values)


def same_telemetry(a, b):
    assert_same_tables(a.gyro, b.gyro)
    for one, other in zip(a.star_trackers, b.star_trackers, strict=True):
        assert_same_tables(one, other)
    assert a.settings == b.settings


@pytest.mark.parametrize("settings", [{}, {"estimator": "batch"}, {"estimator": "paper", "filter": {"gate_nis": 40}}], ids=str)
def test_calibrate_is_that_of_the_program(settings, flown, pass_nc, work):
    config = work / "settings.toml"
    config.write_text("".join(f'{k} = "{v}"\n' for k, v in settings.items() if isinstance(v, str))
                      + ("[filter]\ngate_nis = 40\n" if "filter" in settings else ""))
    program("calibrate", pass_nc, "-o", work / "out", "--config", config)
    result = trihedron.calibrate(flown, **settings)

    text = (work / "out" / "calibration.json").read_text()
    assert result.to_json() == text
    told = json.loads(text)
    assert result.to_dict() == told
    assert_same_bits(result.covariance, told["covariance"]["matrix"])
    assert result.states == told["covariance"]["states"]
    assert result.verdict.trustworthy == told["verdict"]["trustworthy"]
    assert [its.code for its in result.findings] == [its["code"] for its in told["verdict"]["findings"]]

    result.write_attitude(work / "attitude.csv")
    assert (work / "attitude.csv").read_bytes() == (work / "out" / "attitude.csv").read_bytes()
    for group, table in (("fixes", result.residuals), ("parameters", result.history), ("angle", result.angle)):
        with xr.open_dataset(work / "out" / "residuals.nc", group=group, engine="h5netcdf", decode_times=False) as written:
            assert_same_tables(table, written)


def test_the_numbers_are_those_of_the_files(calibrated):
    told = calibrated.to_dict()
    assert calibrated.states[0] == "gyro1.k0"
    by_state = dict(zip(calibrated.states, calibrated.values, strict=True))
    assert by_state["gyro1.mu12"] == told["gyros"][0]["drift_rad_s"]["mu12"]
    assert by_state["gyro2.align_y"] == told["gyros"][1]["alignment_rotation_vector_rad"][1]
    assert calibrated.parameters.sigma.sel(state="gyro1.k0").item() == np.sqrt(calibrated.covariance[0, 0])


def test_definitive_attitude_is_that_of_the_program(flown, pass_nc, work):
    program("calibrate", pass_nc, "-o", work / "definitive", "--definitive")
    result = trihedron.calibrate(flown, definitive=True)
    result.write_attitude(work / "definitive.csv", definitive=True)
    assert (work / "definitive.csv").read_bytes() == (work / "definitive" / "definitive-attitude.csv").read_bytes()
    assert result.definitive_attitude.sizes["time"] > 8 * 60 * 24


@pytest.mark.parametrize("interval", [None, "10min", "continuous"])
def test_navigate_online_is_that_of_the_program(interval, flown, pass_nc, work):
    program("navigate", pass_nc, "--online", "-o", work / "online.csv", *(["--correction-interval", interval] if interval else []))
    result = trihedron.navigate(flown, correction_interval=interval)
    result.write_attitude(work / "python.csv")
    assert (work / "python.csv").read_bytes() == (work / "online.csv").read_bytes()


def test_navigate_with_a_calibration_is_that_of_the_program(flown, calibrated, pass_nc, work):
    calibrated.write(work / "calibration.json")
    program("navigate", pass_nc, "--calibration", work / "calibration.json", "-o", work / "held.csv")
    for calibration in (calibrated, calibrated.to_dict(), work / "calibration.json"):
        trihedron.navigate(flown, calibration=calibration).write_attitude(work / "python.csv")
        assert (work / "python.csv").read_bytes() == (work / "held.csv").read_bytes()
    program("navigate", pass_nc, "--prior", "-o", work / "prior.csv")
    trihedron.navigate(flown, online=False).write_attitude(work / "python.csv")
    assert (work / "python.csv").read_bytes() == (work / "prior.csv").read_bytes()


def test_simulate_is_that_of_the_program(flown):
    simulated = trihedron.simulate(SCENARIO)
    same_telemetry(simulated, flown)
    assert_same_tables(simulated.truth, flown.truth)
    assert simulated.truth.attrs["truth_json"] == flown.truth.attrs["truth_json"]
    same_telemetry(trihedron.simulate({"scenario": {"duration": "25min"}}, seed=7), flown)
    other = trihedron.simulate(SCENARIO, seed=8)
    assert not np.array_equal(other.gyro.h1_x.values, flown.gyro.h1_x.values)


def test_observe_is_that_of_the_program(flown, pass_nc):
    told = json.loads(program("observe", pass_nc, "--json"))
    found = trihedron.observe(flown)
    assert_same_bits(found.singular_values, told["singular_values"])
    assert found.attitude_error_rad == told["attitude_error_rad"]
    for parameter in told["parameters"]:
        assert_same_bits(found.parameters.sigma_until.sel(parameter=parameter["name"]).values, parameter["sigma_until"])
    assert [its.text for its in found.weak] == [its["text"] for its in told["combinations"]]


def test_a_directory_is_read_as_the_program_reads_it(pass_directory, work):
    program("calibrate", pass_directory, "-o", work / "of-directory")
    read = trihedron.read_pass(pass_directory)
    assert trihedron.calibrate(read).to_json() == (work / "of-directory" / "calibration.json").read_text()
    assert read.truth is not None


def test_the_clocks_of_a_directory_are_corrected_as_by_the_program(pass_directory, tmp_path):
    """Its stamps are raw in Python, with settings that say how far they are off."""
    shutil.copytree(pass_directory, tmp_path / "late")
    toml = (tmp_path / "late" / "pass.toml").read_text()
    assert "[[gyro.unit]]" not in toml
    toml += "\n[[gyro.unit]]\n[[gyro.unit]]\nlatency_s = 0.02\n"
    toml = toml.replace("[star_tracker]\n", "[star_tracker]\nclock_offset_s = 0.3\nclock_rate_s_s = 1e-5\n")
    (tmp_path / "late" / "pass.toml").write_text(toml)
    program("import", tmp_path / "late", "-o", tmp_path / "corrected.nc")
    read, corrected = trihedron.read_pass(tmp_path / "late"), trihedron.read_pass(tmp_path / "corrected.nc")
    assert read.settings.to_dict()["star_tracker"]["clock_offset_s"] == 0.3
    assert "clock_offset_s" not in corrected.settings.to_dict()["star_tracker"]
    for one, other in zip(read.events(), corrected.events(), strict=True):
        assert type(one) is type(other) and abs(one.t_s - other.t_s) < 2e-9
        if isinstance(one, trihedron.GyroSample):
            np.testing.assert_allclose(one.directions, other.directions, rtol=0, atol=3e-10)  # in steps of 5e-10 in the file


def test_the_program_reads_what_python_writes(flown, work):
    flown.to_netcdf(work / "rewritten.nc")
    same_telemetry(trihedron.read_pass(work / "rewritten.nc"), flown)
    program("calibrate", work / "rewritten.nc", "-o", work / "of-rewritten")
    assert trihedron.calibrate(flown).to_json() == (work / "of-rewritten" / "calibration.json").read_text()
    simulated = trihedron.simulate(SCENARIO)
    simulated.to_netcdf(work / "simulated.nc")
    same_telemetry(trihedron.read_pass(work / "simulated.nc"), simulated)
    assert trihedron.read_pass(work / "simulated.nc").truth is not None


def test_a_pass_goes_through_a_datatree(flown, pass_nc, calibrated):
    same_telemetry(trihedron.Pass.from_datatree(flown.to_datatree()), flown)
    with xr.open_datatree(pass_nc, engine="h5netcdf") as tree:  # with times decoded
        assert tree["gyro"].t_s.dtype.kind == "M"
        assert tree.trihedron.calibrate().to_json() == calibrated.to_json()


def test_attributes_say_frames_and_units(flown):
    assert flown.gyro.h2_x.attrs["frame"] == "b2" and flown.gyro.h2_x.attrs["units"] == "1"
    assert flown.star_tracker.q_w.attrs["frame"].startswith("in_c")
    assert flown.truth.h1_x.attrs["frame"] == "in"
    assert "TAI" in flown.gyro.t_s.attrs["comment"]
    assert flown.epoch == np.datetime64(flown.settings.to_dict()["pass"]["epoch_tai"])


def test_a_pipeline_gives_the_attitude_of_navigate(flown):
    navigated = trihedron.navigate(flown)
    expected = navigated.attitude
    pipeline = trihedron.Pipeline(flown.settings)
    rows = []
    corrections = 0
    for event in flown.events():
        reports = (pipeline.push_gyro(event.t_s, event.directions) if isinstance(event, trihedron.GyroSample)
                   else pipeline.push_fix(*event))
        corrections += sum(report.corrected for report in reports)
        attitude = pipeline.attitude
        if isinstance(event, trihedron.GyroSample) and attitude is not None and reports[0].sample == "used":
            rows.append((event.t_s, *attitude.q_in_c))
    assert pipeline.started and corrections == navigated.corrections
    rows = np.array(rows)
    assert_same_bits(rows[:, 0], expected.t_s.values)
    for i, name in enumerate(("q_x", "q_y", "q_z", "q_w")):
        assert_same_bits(rows[:, i + 1], expected[name].values)


def test_feed_reports_every_event(flown):
    pipeline = trihedron.Pipeline(flown)
    assert pipeline.attitude is None and pipeline.calibration is None
    reports = list(pipeline.feed(flown.events()))
    assert sum(report.sample != "" for report in reports) == flown.gyro.sizes["time"]
    assert sum(report.fix == "used" for report in reports) > 450
    assert pipeline.calibration["covariance"]["states"][0] == "gyro1.k0"
    assert pipeline.attitude.covariance_rad2.shape == (3, 3)


THREE_GYROS_AND_TWO_HEADS = """
[scenario]
duration = "8min"
seed = 11
[gyro]
gaps = [{begin = "3min", end = "4min"}]
[[gyro.unit]]
start_direction_c = [0.995, 0.087, 0.045]
[[gyro.unit]]
start_direction_c = [0.14, 0.985, 0.094]
[[gyro.unit]]
start_direction_c = [0.1, 0.2, 0.97]
[star_tracker]
outlier_probability = 0.01
[[star_tracker.further]]
mounting_rotation_vector = ["0deg", "60deg", "0deg"]
"""


def test_more_gyros_and_star_trackers_with_faults_go_both_ways(work):
    (work / "three.toml").write_text(THREE_GYROS_AND_TWO_HEADS)
    program("simulate", work / "three.toml", "-o", work / "three.nc")
    read = trihedron.read_pass(work / "three.nc")
    assert read.settings.gyros == 3 and len(read.star_trackers) == 2
    assert {defect.kind for defect in read.defects} >= {"gap"}
    same_telemetry(trihedron.simulate(work / "three.toml"), read)
    spoilt = read.gyro.copy(deep=True)
    spoilt.h3_y[50:60] = np.nan
    spoilt.t_s[[70, 71]] = spoilt.t_s.values[[71, 70]]
    dirty = trihedron.Pass(read.settings, spoilt, read.star_trackers)
    dirty.to_netcdf(work / "dirty.nc")
    program("calibrate", work / "dirty.nc", "-o", work / "of-dirty")
    assert trihedron.calibrate(dirty).to_json() == (work / "of-dirty" / "calibration.json").read_text()
    program("navigate", work / "dirty.nc", "--online", "-o", work / "of-dirty.csv")
    trihedron.navigate(dirty).write_attitude(work / "python.csv")
    assert (work / "python.csv").read_bytes() == (work / "of-dirty.csv").read_bytes()
    reports = list(trihedron.Pipeline(dirty).feed(dirty.events()))
    assert {report.head for report in reports if report.fix} == {0, 1}


def test_an_earlier_calibration_goes_along(flown, calibrated, work):
    later = trihedron.Pass(flown.settings.toml, flown.gyro, flown.star_trackers, prior=calibrated.to_dict())
    later.to_netcdf(work / "with-prior.nc")
    program("calibrate", work / "with-prior.nc", "-o", work / "of-prior")
    found = trihedron.calibrate(later)
    assert found.to_json() == (work / "of-prior" / "calibration.json").read_text()
    assert found.to_json() != calibrated.to_json()
    assert trihedron.read_pass(work / "with-prior.nc").settings.prior == later.settings.prior
