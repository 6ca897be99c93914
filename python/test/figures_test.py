"""The figures are drawn of what the results hold."""
import numpy as np
import pytest

import trihedron
from trihedron import plots


@pytest.fixture(scope="module")
def evaluation(calibrated):
    return calibrated.evaluate()


def lines(figure):
    return [line for axis in figure.axes for line in axis.lines]


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
    assert np.abs(evaluation.estimate_minus_truth / calibrated.sigmas).max() < 6


def test_without_a_truth_the_star_tracker_is_the_reference(flown):
    bare = trihedron.Pass(flown.settings, flown.gyro, flown.star_trackers)
    evaluation = trihedron.calibrate(bare).evaluate()
    assert evaluation.reference == "star tracker" and evaluation.estimate_minus_truth.size == 0
