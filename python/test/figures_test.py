"""The figures are drawn of what the results hold."""
import re

import numpy as np
import pytest

import trihedron
from conftest import ROOT
from trihedron import plots

# Figures of the report that have another name, or are in one with others.
OF_THE_REPORT = {"alignment": "parameters", "attitude": "attitude_uncertainty", "coefficient": "parameters", "innovations": "residuals",
                 "nis": "residuals", "open_loops": "open_loop"}


@pytest.fixture(scope="module")
def evaluation(calibrated):
    return calibrated.evaluate()


def lines(figure):
    return [line for axis in figure.axes for line in axis.lines]


def test_each_figure_of_the_report_has_one():
    figures = set(re.findall(r'data-figure="(\w+)"', (ROOT / "report/assets/page.html").read_text()))
    assert len(figures) > 10
    assert {OF_THE_REPORT.get(name, name) for name in figures} == set(plots.__all__)


def test_residuals_show_every_fix(calibrated, work):
    figure = plots.residuals(calibrated)
    assert len(figure.axes) == 5
    shown = sum(len(line.get_xdata()) for line in figure.axes[-1].lines)
    assert shown == calibrated.residuals.sizes["time"]
    np.testing.assert_allclose(figure.axes[0].lines[0].get_ydata(),
                               np.degrees(calibrated.residuals.innovation_gyro1_1.values) * 3600, rtol=1e-14)
    figure.savefig(work / "residuals.png")
    assert (work / "residuals.png").stat().st_size > 10000


def test_parameters_show_each_state_of_the_history(calibrated):
    names = [name for name in calibrated.history.data_vars if not name.endswith("_sigma")]
    figure = plots.parameters(calibrated)
    assert len(lines(figure)) == len(names)


def test_open_loops_are_those_of_the_evaluation(evaluation):
    loops = evaluation.open_loops
    assert evaluation.reference == "truth" and len(loops) >= 1
    assert len(lines(plots.open_loop(evaluation))) == 3 * len(loops) + 1
    errors = loops[0].calibrated
    assert errors.sizes["time"] > 100 and np.isfinite(errors.error_x_rad.values).all()
    assert loops[0].predicted.after_s[0] == 0


def test_attitude_errors_are_within_their_bounds(evaluation):
    figure = plots.attitude_uncertainty(evaluation)
    errors = evaluation.attitude
    assert len(lines(figure)) == 9
    late = errors.isel(time=slice(errors.sizes["time"] // 2, None))
    squares = np.mean([(late[f"error_{a}_rad"] / late[f"sigma_{a}_rad"]).values ** 2 for a in "xyz"])
    assert 0.01 < squares < 9  # errors and sigmas are of one kind: a wrong unit is off by a thousand


def test_forecast_is_that_of_the_result(calibrated, flown):
    for result in (calibrated, trihedron.navigate(flown)):
        figure = plots.forecast(result)
        np.testing.assert_array_equal(figure.axes[0].lines[0].get_xdata(), result.forecast.errors.after_s / 3600)


def test_estimates_are_compared_with_the_truth(evaluation, calibrated):
    assert evaluation.estimate_minus_truth.shape == (len(calibrated.states),)
    known = np.isfinite(evaluation.estimate_minus_truth)  # the truth has not all members outside eq. (1)
    assert known.sum() >= 20
    assert np.abs((evaluation.estimate_minus_truth / calibrated.sigmas)[known]).max() < 6


def test_without_a_truth_the_star_tracker_is_the_reference(flown):
    bare = trihedron.Pass(flown.settings, flown.gyro, flown.star_trackers)
    evaluation = trihedron.calibrate(bare).evaluate()
    assert evaluation.reference == "star tracker" and evaluation.estimate_minus_truth.size == 0


def test_histogram_is_of_the_fixes_used(calibrated):
    counted, _ = np.histogram([], bins=np.arange(-5, 5.25, 0.25))
    axis = plots.histogram(calibrated).axes[0]
    assert len(axis.patches) == len(counted)
    assert sum(patch.get_height() * patch.get_width() for patch in axis.patches) == pytest.approx(1)
    assert axis.patches[len(counted) // 2].get_height() == pytest.approx(axis.lines[0].get_ydata().max(), rel=0.2)


def test_navigator_is_shown_with_its_corrections(evaluation):
    figure = plots.navigation(evaluation)
    assert len(lines(figure)) == 3 * (1 + len(evaluation.open_loops))
    np.testing.assert_allclose(figure.axes[1].lines[0].get_ydata(), np.degrees(evaluation.navigation.error_y_rad.values) * 60, rtol=1e-12)


def test_drift_models_are_those_that_were_compared(calibrated, flown):
    result = trihedron.calibrate(flown, estimator="batch", drift_model="vsh:2")
    models = result.drift_models
    assert models.model.values.tolist() == ["esg7", "vsh:1", "vsh:2"] and models.coefficients.values.tolist() == [7, 13, 19]
    assert (models.forecast_error_rad > 0).all() and models.log_likelihood.values[2] < 0 == models.log_likelihood.values[0]
    figure = plots.drift_models(result)
    np.testing.assert_allclose(figure.axes[0].lines[0].get_ydata(), np.degrees(models.forecast_error_rad.values) * 3600, rtol=1e-14)
    assert calibrated.drift_models.sizes["model"] == 0  # a drift field
    with pytest.raises(ValueError, match="compares no drift models"):
        plots.drift_models(calibrated)


def test_correlations_are_those_of_the_covariance(calibrated):
    shown = plots.correlation(calibrated).axes[0].images[0].get_array()
    assert shown.shape == (20, 20)  # eq. (1) and alignment of two gyros
    np.testing.assert_allclose(np.diag(shown), 1)
    one, other = (calibrated.states.index(name) for name in ("gyro1.k0", "gyro1.mu12"))
    assert shown[0, 1] == calibrated.covariance[one, other] / (calibrated.sigmas[one] * calibrated.sigmas[other])


def test_tracks_and_telemetry_are_those_of_the_pass(calibrated):
    figure = plots.tracks(calibrated)
    assert len(figure.axes) == calibrated.of.settings.gyros
    first = np.array([calibrated.of.gyro[f"h2_{axis}"].values[0] for axis in "xyz"])
    np.testing.assert_allclose(np.ravel(figure.axes[1].lines[0].get_data_3d())[:: len(figure.axes[1].lines[0].get_data_3d()[0])], first)
    came = plots.telemetry(calibrated)
    top = came.axes[1].collections[-1].get_paths()[0].vertices[:, 1].max()
    assert 90 < top <= 110  # percent: the fixes of a bin are whole


def test_angle_is_that_of_the_result(calibrated):
    shown = plots.angle(calibrated).axes[0].lines[1].get_ydata()
    np.testing.assert_array_equal(shown, calibrated.angle.residual_max.values * 1e6)
