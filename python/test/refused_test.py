"""What cannot be understood is refused, with reason and cure; telemetry that is merely bad is counted."""
import datetime
import pickle
import re

import numpy as np
import pytest
import xarray as xr

import trihedron
from trihedron import InputRefused, Pass, Pipeline, SetupError


def refusal(function, *arguments, kind=InputRefused, **keywords):
    with pytest.raises(kind) as caught:
        function(*arguments, **keywords)
    error = caught.value
    assert error.reason and error.cure and error.cure in str(error)
    assert isinstance(error, trihedron.TrihedronError)
    return error


@pytest.fixture()
def arrays(flown):
    names = [f"h{k}_{axis}" for k in (1, 2) for axis in "xyz"]
    h = np.stack([flown.gyro[name].values for name in names], axis=1).reshape(-1, 2, 3)
    q = np.stack([flown.star_tracker[f"q_{c}"].values for c in "xyzw"], axis=1)
    return {"settings": flown.settings, "gyro_t_s": flown.gyro.t_s.values, "directions": h,
            "star_tracker_t_s": flown.star_tracker.t_s.values, "q_in_c": q}


def test_arrays_make_the_same_pass(arrays, calibrated):
    assert trihedron.calibrate(Pass.from_arrays(**arrays)).to_json() == calibrated.to_json()


def test_arrays_need_not_be_contiguous_and_of_float64(arrays, calibrated):
    arrays["directions"] = np.asfortranarray(arrays["directions"])
    wide = np.zeros((len(arrays["q_in_c"]), 8))
    wide[:, ::2] = arrays["q_in_c"]
    arrays["q_in_c"] = wide[:, ::2]
    assert not arrays["q_in_c"].flags.c_contiguous
    assert trihedron.calibrate(Pass.from_arrays(**arrays)).to_json() == calibrated.to_json()
    arrays["star_tracker_t_s"] = arrays["star_tracker_t_s"].astype(np.int64)
    assert Pass.from_arrays(**arrays).star_tracker.t_s.dtype == np.float64


@pytest.mark.parametrize("name, value, reason", [
    ("directions", np.zeros((12001, 6)), "directions has shape (12001, 6)"),
    ("directions", np.zeros((7, 2, 3)), "directions has shape (7, 2, 3)"),
    ("q_in_c", np.zeros((501, 3)), "q_in_c has shape (501, 3)"),
    ("q_in_c", np.zeros((501, 4), complex), "dtype complex128"),
    ("q_in_c", np.full((501, 4), "1"), "dtype <U1"),
    ("q_in_c", [[1, 0, 0, 0], [1, 0]], "is no array"),
    ("gyro_t_s", np.array([[0.0]]), "gyro_t_s has shape (1, 1)"),
    ("gyro_t_s", [datetime.datetime(2009, 5, 20)], "dtype object"),
    ("gyro_t_s", None, "dtype object"),
])
def test_wrong_arrays_are_refused(name, value, reason, arrays):
    assert reason in refusal(Pass.from_arrays, **{**arrays, name: value}).reason


def test_bad_rows_are_counted(arrays):
    t, h, q = (arrays[name].copy() for name in ("gyro_t_s", "directions", "q_in_c"))
    h[100:103, 1, 0] = np.nan
    t[200], t[201] = t[201], t[200]
    t[300] = np.nan
    q[50] = np.inf
    found = {(its.kind, its.where): its.count
             for its in Pass.from_arrays(**{**arrays, "gyro_t_s": t, "directions": h, "q_in_c": q}).defects}
    assert found["missing-value", "gyro, gyro 2"] == 3
    kinds = {kind for kind, _ in found}
    assert {"backward-time", "missing-time", "missing-value"} <= kinds


def test_telemetry_of_which_nothing_can_be_used_is_refused(arrays):
    assert "star_tracker" in str(refusal(Pass.from_arrays(**{**arrays, "q_in_c": np.full_like(arrays["q_in_c"], np.nan)})._screened))
    assert refusal(Pass.from_arrays(**{**arrays, "gyro_t_s": np.full_like(arrays["gyro_t_s"], np.nan)})._screened)


@pytest.mark.parametrize("settings, reason", [
    ("[pass]\nepoch_tai = 3", "epoch_tai of the settings is 3"),
    ('[pass]\nepoch_tai = "2009-05-20T00:00:00Z"', "00Z"),
    ("", "epoch_tai of the settings is None"),
    ("pass = 7", "epoch_tai of the settings is None"),
    ("epoch_tai", "no TOML"),
    ({"pass": {"epoch_tai": "2009-05-20T00:00:00", "spacecraft": None}}, "cannot be TOML"),
])
def test_wrong_settings_of_a_pass_are_refused(settings, reason, arrays):
    assert reason in refusal(Pass.from_arrays, **{**arrays, "settings": settings}).reason


def test_settings_of_a_pass_are_refused_with_their_line(arrays):
    toml = arrays["settings"].toml.replace("[star_tracker]", "[star_tracker]\nnose_rad = 1")
    error = refusal(Pass.from_arrays(**{**arrays, "settings": toml})._screened)
    assert "nose_rad" in error.reason and error.line == toml.splitlines().index("nose_rad = 1") + 1
    toml = re.sub("^period_s = .*", "period_s = nan", arrays["settings"].toml, flags=re.MULTILINE)
    assert "period_s" in refusal(Pass.from_arrays(**{**arrays, "settings": toml})._screened).reason


@pytest.mark.parametrize("settings, reason", [
    ({"gate": 3}, 'key "gate" is not known'),
    ({"estimator": "kalman"}, "kalman"),
    ({"estimator": 3}, "estimator"),
    ({"estimator": None}, "cannot be TOML"),
    ({"filter": {"gate_nis": -1}}, "gate_nis"),
    ({"filter": {"gate_nis": float("nan")}}, "gate_nis"),
    ({"filter": 7}, "filter"),
    ({"need": "5arcmin"}, "need"),
    ({"corrections": {"interval": "90"}}, "interval"),
    ({"drift_model": "vsh:99"}, "vsh:99"),
])
@pytest.mark.parametrize("function", [trihedron.calibrate, trihedron.navigate, trihedron.observe, Pipeline])
def test_wrong_settings_are_refused(settings, reason, function, flown):
    assert reason in refusal(function, flown, **settings).reason
    assert reason in refusal(function, flown, settings=settings).reason


def test_settings_come_from_files_and_dictionaries(flown, work):
    file = work / "some.toml"
    file.write_text('estimator = "paper"\n[filter]\ngate_nis = 40\n')
    assert Pipeline(flown, settings=file, filter={"student_t_freedom": 8}).settings["filter"]["gate_nis"] == 40
    assert "no such file" in refusal(Pipeline, flown, settings=work / "none.toml").reason.lower()
    file.write_text("estimator = ")
    assert refusal(Pipeline, flown, settings=file).file == str(file)


@pytest.mark.parametrize("function", [trihedron.calibrate, trihedron.navigate])
def test_what_is_no_pass_is_refused(function, pass_nc):
    assert "str" in refusal(function, str(pass_nc)).reason


def test_a_wrong_progress_is_refused(flown):
    assert refusal(trihedron.calibrate, flown, progress=3)


def test_navigate_refuses_what_is_no_calibration(flown, calibrated, work):
    assert refusal(trihedron.navigate, flown, calibration={"format": "other"})
    assert refusal(trihedron.navigate, flown, calibration=work / "none.json")
    assert refusal(trihedron.navigate, flown, calibration=calibrated, online=True)
    assert refusal(trihedron.navigate, flown, correction_interval="90")


def test_simulate_refuses(work):
    assert 'key "duratoin" is not known' in refusal(trihedron.simulate, {"scenario": {"duratoin": "1h"}}).reason
    assert refusal(trihedron.simulate, {"scenario": {"duration": "1h"}}, seed=-1)
    assert refusal(trihedron.simulate, {"scenario": {"duration": "1h"}}, seed="7")
    assert refusal(trihedron.simulate, {"scenario": 3}, seed=7)
    assert refusal(trihedron.simulate, work / "none.toml").file == str(work / "none.toml")
    file = work / "wrong.toml"
    file.write_text("[scenario]\nduration = 7\n")
    assert refusal(trihedron.simulate, file).line == 2
    file.write_bytes(b"\xff")
    assert refusal(trihedron.simulate, file)
    assert refusal(trihedron.simulate, {"orbit": {"perigee_altitude": "-7000km"}})


def test_files_that_are_no_pass_are_refused(work):
    assert refusal(trihedron.read_pass, work / "none").file == str(work / "none")
    assert refusal(trihedron.read_pass, work)  # a directory without pass.toml
    (work / "telemetry.toml").write_text("[telemetry]\n")
    assert '"time" is missing' in refusal(trihedron.read_pass, work / "telemetry.toml").reason
    wrong = work / "wrong.nc"
    wrong.write_bytes(b"CDF or not")
    assert refusal(trihedron.read_pass, wrong).file == str(wrong)
    xr.Dataset({"h1_x": ("time", [1.0])}).to_netcdf(wrong, engine="h5netcdf")
    assert 'lacks the attribute "pass_toml"' in refusal(trihedron.read_pass, wrong).reason


def test_datasets_are_refused_where_they_are_no_pass(flown):
    def with_gyro(gyro):
        return Pass(flown.settings, gyro, flown.star_trackers)._screened

    assert "lacks the variable h2_z" in refusal(with_gyro(flown.gyro.drop_vars("h2_z"))).reason
    assert "lacks the variable t_s" in refusal(with_gyro(flown.gyro.drop_vars("t_s"))).reason
    degrees = flown.gyro.assign(h1_x=flown.gyro.h1_x.assign_attrs(units="deg"))
    assert "units 'deg'" in refusal(with_gyro(degrees)).reason
    later = flown.gyro.assign_coords(t_s=flown.gyro.t_s.assign_attrs(units="seconds since 2010-01-01T00:00:00"))
    assert "seconds since 2010" in refusal(with_gyro(later)).reason
    tree = flown.to_datatree()
    del tree["star_tracker"]
    assert 'lacks group "star_tracker"' in refusal(Pass.from_datatree, tree).reason
    assert "2 tables of star trackers" in refusal(Pass(flown.settings, flown.gyro, flown.star_trackers * 2)._screened).reason
    assert "not all of its gyro" in refusal(Pass, flown.settings.toml, flown.gyro.drop_vars("h2_z"), flown.star_trackers).reason
    assert "no columns" in refusal(Pass, flown.settings.toml, flown.star_tracker, flown.star_trackers).reason


def test_a_pass_that_cannot_work_is_a_setup_error(arrays):
    on_one_line = arrays["directions"].copy()
    on_one_line[:, 1] = -on_one_line[:, 0]  # such momenta give no attitude
    error = refusal(trihedron.calibrate, Pass.from_arrays(**{**arrays, "directions": on_one_line}), kind=SetupError)
    assert "no fix could be used" in error.reason


def test_events_of_a_wrong_form_are_refused(flown):
    pipeline = Pipeline(flown)
    assert "shape (3,)" in refusal(pipeline.push_gyro, 0.0, [1, 0, 0]).reason
    assert "(3, 3)" in refusal(pipeline.push_gyro, 0.0, np.eye(3)).reason
    assert "t_s is 'now'" in refusal(pipeline.push_gyro, "now", np.eye(3)[:2]).reason
    assert "t_s is nan" in refusal(pipeline.push_gyro, float("nan"), np.eye(3)[:2]).reason
    assert "t_s is inf" in refusal(pipeline.push_fix, float("inf"), [0, 0, 0, 1]).reason
    assert "shape (3,)" in refusal(pipeline.push_fix, 0.0, [0, 0, 1]).reason
    assert "head is 1" in refusal(pipeline.push_fix, 0.0, [0, 0, 0, 1], head=1).reason
    assert "tuple" in refusal(list, pipeline.feed([(0.0, [0, 0, 0, 1])])).reason
    assert "str" in refusal(Pipeline, "pass.toml").reason


def test_bad_events_are_data(flown):
    pipeline = Pipeline(flown)
    events = flown.events()
    for _, event in zip(range(100), events):
        pipeline.push_gyro(*event) if isinstance(event, trihedron.GyroSample) else pipeline.push_fix(*event)
    bad = pipeline.push_gyro(60.0, np.full((2, 3), np.nan))
    assert bad[0].sample not in ("", "used")
    assert pipeline.push_gyro(10.0, np.eye(3)[:2])[0].sample != "used"  # back in time
    assert pipeline.push_fix(61.0, [np.nan] * 4) is not None


def test_errors_go_through_pickle():
    error = InputRefused("reason", "cure", "file", 3, 4)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "file:3:4: reason; cure" and again.line == 3


def test_a_disk_that_fails_is_told(flown, calibrated, work):
    for write in (flown.to_netcdf, calibrated.write, calibrated.write_attitude):
        error = refusal(write, work / "no-such-directory" / "file", kind=trihedron.MachineFailed)
        assert error.file == str(work / "no-such-directory" / "file")
