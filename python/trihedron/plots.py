"""The figures of the report, by matplotlib: `pip install trihedron[plots]`. Each gives a figure of its own."""

from __future__ import annotations

import functools
import io
from typing import TYPE_CHECKING

import numpy as np

from ._arrays import Doubles
from ._results import Calibration, Evaluation, Navigation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "angle",
    "attitude_uncertainty",
    "correlation",
    "drift_models",
    "forecast",
    "histogram",
    "navigation",
    "open_loop",
    "parameters",
    "residuals",
    "telemetry",
    "tracks",
]

_HOUR = 3600.0
_ARCSEC = 180 * 3600 / np.pi
_ARCMIN = 180 * 60 / np.pi
_DEG_H = 180 * 3600 / np.pi
_AXES = {"x": "roll", "y": "pitch", "z": "heading"}


@functools.cache
def _shown_by_notebooks() -> type[Figure]:
    from matplotlib.figure import Figure

    class ShownFigure(Figure):
        """A figure that notebooks show, whatever of pyplot has been imported."""

        def _repr_png_(self) -> bytes:
            png = io.BytesIO()
            self.savefig(png, format="png")
            return png.getvalue()

    return ShownFigure


def _figure(rows: int, columns: int = 1, height: float = 2.0) -> tuple[Figure, list[Axes]]:
    figure = _shown_by_notebooks()(figsize=(9.0, 1.0 + height * rows), layout="constrained")
    return figure, list(np.atleast_1d(figure.subplots(rows, columns, sharex=True)).ravel())


def _hours(dataset: xr.Dataset) -> Doubles:
    return np.asarray(dataset.t_s.values) / _HOUR


def _finish(axes: list[Axes]) -> None:
    for its in axes:
        its.grid(visible=True, alpha=0.3)
    axes[-1].set_xlabel("time since the epoch, h")


def residuals(result: Calibration) -> Figure:
    """Innovations of each fix with their 3-sigma bounds, and the NIS with those fixes that were not used."""
    fixes = result.residuals
    names = [str(name) for name in fixes.data_vars if str(name).startswith("innovation") and not str(name).endswith("sigma")]
    figure, axes = _figure(len(names) + 1, height=1.5)
    t = _hours(fixes)
    for axis, name in zip(axes, names):
        bound = 3 * fixes[f"{name}_sigma"].values * _ARCSEC
        axis.plot(t, fixes[name].values * _ARCSEC, ".", markersize=1)
        axis.plot(t, bound, "k-", t, -bound, "k-", linewidth=0.6)
        finite = bound[np.isfinite(bound)]
        if finite.size:  # outliers would hide all the rest
            axis.set_ylim(-3 * np.median(finite), 3 * np.median(finite))
        axis.set_ylabel(name.removeprefix("innovation_") + ", ″")
    used = fixes.used.values > 0
    axes[-1].semilogy(t[used], fixes.nis.values[used], ".", markersize=1, label="used")
    axes[-1].semilogy(t[~used], fixes.nis.values[~used], "rx", markersize=4, label="not used")
    axes[-1].set_ylabel("NIS")
    axes[-1].legend(loc="upper right")
    _finish(axes)
    figure.suptitle("Residuals of the fixes, 3σ")
    return figure


def histogram(result: Calibration) -> Figure:
    """Innovations of the fixes that were used over their sigmas, with the normal density that they should have."""
    fixes = result.residuals.isel(time=result.residuals.used.values > 0)
    names = [str(name) for name in fixes.data_vars if str(name).startswith("innovation") and not str(name).endswith("sigma")]
    normalised = np.concatenate([(fixes[name] / fixes[f"{name}_sigma"]).values for name in names])
    figure, axes = _figure(1, height=3)
    axes[0].hist(normalised[np.isfinite(normalised)], bins=list(np.arange(-5, 5.25, 0.25)), density=True, label="innovations")
    x = np.linspace(-5, 5, 201)
    axes[0].plot(x, np.exp(-x * x / 2) / np.sqrt(2 * np.pi), "k-", linewidth=1, label="normal")
    axes[0].set_ylabel("density")
    axes[0].legend()
    _finish(axes)
    axes[0].set_xlabel("innovation over its sigma")
    figure.suptitle("Innovations of the fixes used")
    return figure


def parameters(result: Calibration) -> Figure:
    """Estimates along the pass with their 3-sigma bounds: drift coefficients and alignments of each gyro."""
    history = result.history
    names = [str(name) for name in history.data_vars if not str(name).endswith("_sigma")]
    figure, axes = _figure((len(names) + 1) // 2, 2, height=1.3)
    t = _hours(history)
    for axis, name in zip(axes, names):
        is_alignment = "align" in name
        scale = _ARCMIN if is_alignment else _DEG_H
        value, sigma = history[name].values * scale, history[f"{name}_sigma"].values * scale
        axis.fill_between(t, value - 3 * sigma, value + 3 * sigma, alpha=0.3)
        axis.plot(t, value, linewidth=1)
        late = slice(len(t) // 20, None)  # the bounds at the start would hide all the rest
        if value[late].size:
            axis.set_ylim(np.nanmin((value - 3 * sigma)[late]), np.nanmax((value + 3 * sigma)[late]))
        axis.set_ylabel(f"{name}, {'′' if is_alignment else '°/h'}", fontsize=7)
    for axis in axes[len(names) :]:
        axis.set_visible(False)
    _finish(axes)
    figure.suptitle("Estimates along the pass, 3σ")
    return figure


def _total(errors: xr.Dataset) -> Doubles:
    total: Doubles = np.sqrt(np.sum([errors[f"error_{axis}_rad"].values ** 2 for axis in _AXES], axis=0))
    return total


def open_loop(evaluation: Evaluation) -> Figure:
    """Attitude error without the star tracker, from each astro-correction on, with what was predicted of it."""
    loops = evaluation.open_loops
    figure, axes = _figure(1, height=4)
    axis = axes[0]
    for i, loop in enumerate(loops):
        first = i == 0  # the legend needs each once
        for errors, colour, name in ((loop.known_before, "0.7", "parameters known before"), (loop.calibrated, "C0", "calibrated")):
            axis.semilogy(_hours(errors), _total(errors) * _ARCMIN, color=colour, linewidth=0.7, label=name if first else None)
        predicted = loop.predicted
        axis.semilogy(
            (loop.corrected_s + predicted.after_s) / _HOUR,
            predicted.error_997_rad * _ARCMIN,
            "k--",
            linewidth=0.7,
            label="predicted, 99.7 %" if first else None,
        )
    axis.axhline(5, color="r", linewidth=0.7)
    axis.set_ylabel("attitude error, ′")
    axis.legend(loc="lower right")
    _finish(axes)
    figure.suptitle(f"Open loops from each astro-correction, against the {evaluation.reference}")
    return figure


def navigation(evaluation: Evaluation) -> Figure:
    """Errors of the navigator about c x, y, z; dotted: its astro-corrections, from the calibration until then."""
    errors = evaluation.navigation
    corrections = [loop.corrected_s / _HOUR for loop in evaluation.open_loops]
    figure, axes = _figure(3)
    for axis, (name, label) in zip(axes, _AXES.items()):
        axis.plot(_hours(errors), errors[f"error_{name}_rad"].values * _ARCMIN, linewidth=0.7)
        for corrected in corrections:
            axis.axvline(corrected, color="k", linestyle=":", linewidth=0.7)
        axis.set_ylabel(f"{label}, ′")
    _finish(axes)
    figure.suptitle(f"Navigator between astro-corrections, against the {evaluation.reference}")
    return figure


def attitude_uncertainty(evaluation: Evaluation) -> Figure:
    """Errors of the attitude of a calibration about c x, y, z, with the 3-sigma bounds that it claims."""
    errors = evaluation.attitude
    figure, axes = _figure(3)
    t = _hours(errors)
    for axis, (name, label) in zip(axes, _AXES.items()):
        axis.plot(t, errors[f"error_{name}_rad"].values * _ARCSEC, ".", markersize=1)
        if f"sigma_{name}_rad" in errors:
            bound = 3 * errors[f"sigma_{name}_rad"].values * _ARCSEC
            axis.plot(t, bound, "k-", t, -bound, "k-", linewidth=0.6)
            axis.set_ylim(-3 * np.nanmedian(bound), 3 * np.nanmedian(bound))
        axis.set_ylabel(f"{label}, ″")
    _finish(axes)
    figure.suptitle(f"Attitude errors against the {evaluation.reference}, 3σ")
    return figure


def forecast(result: Calibration | Navigation) -> Figure:
    """Attitude error predicted for an open loop from an astro-correction at the end of the pass."""
    if result.forecast is None:
        raise ValueError("the result has no forecast")
    errors = result.forecast.errors
    figure, axes = _figure(1, height=3)
    hours = errors.after_s / _HOUR
    for name, values in (("68 %", errors.error_68_rad), ("95 %", errors.error_95_rad), ("99.7 %", errors.error_997_rad)):
        axes[0].plot(hours, values * _ARCMIN, label=name)
    axes[0].axhline(5, color="r", linewidth=0.7)
    axes[0].set_ylabel("attitude error, ′")
    axes[0].legend()
    _finish(axes)
    axes[0].set_xlabel("time since the correction, h")
    figure.suptitle("Predicted attitude error of an open loop")
    return figure


def drift_models(result: Calibration) -> Figure:
    """Forecast error of each drift model that was compared, by its coefficients; the one used is filled."""
    models = result.drift_models
    if not models.sizes["model"]:
        raise ValueError('the result compares no drift models; estimator="batch" does those up to the one that drift_model tells')
    used = result.to_dict()["gyros"][0]["drift_model"]
    figure, axes = _figure(1, height=3)
    errors = models.forecast_error_rad.values * _ARCSEC
    axes[0].plot(models.coefficients, errors, "C0-", linewidth=0.7)
    for name, coefficients, error in zip(models.model.values, models.coefficients.values, errors):
        axes[0].plot(coefficients, error, "C0o", fillstyle="full" if name == used else "none", label=name)
        axes[0].annotate(str(name), (coefficients, error), textcoords="offset points", xytext=(0, 6), ha="center", fontsize=7)
    axes[0].set_ylabel("forecast error, rms, ″")
    axes[0].set_ylim(bottom=0)
    _finish(axes)
    axes[0].set_xlabel("coefficients of each gyro")
    figure.suptitle("Drift models compared")
    return figure


def correlation(result: Calibration) -> Figure:
    """Correlations of the parameters at the end of the pass, without those members of a drift field that eq. (1) lacks."""
    followed = set(map(str, result.history.data_vars))
    rows = [row for row, name in enumerate(result.states) if name.replace(".", "_") in followed or not followed]
    rho = (result.covariance / np.outer(result.sigmas, result.sigmas))[np.ix_(rows, rows)]
    figure, axes = _figure(1, height=7)
    image = axes[0].imshow(rho, cmap="PuOr_r", vmin=-1, vmax=1)
    names = [result.states[row] for row in rows]
    axes[0].set_xticks(range(len(rows)), names, rotation=90, fontsize=6)
    axes[0].set_yticks(range(len(rows)), names, fontsize=6)
    figure.colorbar(image, ax=axes[0])
    figure.suptitle("Correlation at the end of the pass")
    return figure


def tracks(result: Calibration) -> Figure:
    """Where each momentum pointed in the axes of its case: circle at the start, square at the end."""
    directions = result.of._screened().directions
    figure = _shown_by_notebooks()(figsize=(9.0, 5.0), layout="constrained")
    for gyro in range(directions.shape[1]):
        axis = figure.add_subplot(1, directions.shape[1], gyro + 1, projection="3d")
        h = directions[:: max(1, len(directions) // 5000), gyro]
        h = h[np.abs(np.linalg.norm(h, axis=1) - 1) < 0.01]  # NaN is not
        axis.plot(*h.T, linewidth=0.7)
        for place, marker in ((h[:1], "o"), (h[-1:], "s")):
            axis.plot(*place.T, marker)
        axis.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1), xlabel="x", ylabel="y", zlabel="z", title=f"gyro {gyro + 1}")
        axis.set_box_aspect((1, 1, 1))
    figure.suptitle("Track of each momentum in its case")
    return figure


def angle(result: Calibration) -> Figure:
    """Residual of the cosine of the angle between the momenta, z1 of eq. (3): least and greatest of each three seconds."""
    found = result.angle
    figure, axes = _figure(1, height=3)
    for values in (found.residual_min.values, found.residual_max.values):
        axes[0].plot(_hours(found), values * 1e6, "C0", linewidth=0.5)
    axes[0].set_ylabel("z₁, 10⁻⁶")
    _finish(axes)
    figure.suptitle("Residual of the angle between the momenta")
    return figure


def telemetry(result: Calibration) -> Figure:
    """Gyro samples and fixes of the first star tracker, in percent of those that their periods let expect."""
    settings = result.of.settings.to_dict()
    screened = result.of._screened()
    sample_s = (screened.gyro_ns - result.of.settings.epoch_ns) * 1e-9
    good = np.all(np.abs(np.linalg.norm(screened.directions, axis=2) - 1) < 0.01, axis=1)
    fixes = result.residuals
    used = fixes.used.values > 0
    duration_s = float(settings["pass"]["duration_s"])
    edges = np.append(np.arange(0, duration_s, max(60.0, duration_s / 180)), duration_s)
    figure, axes = _figure(2)
    shown = (
        (axes[0], "gyro", {"good": sample_s[good], "bad": sample_s[~good]}, "gyro samples, %"),
        (axes[1], "star_tracker", {"used": fixes.t_s.values[used], "not used": fixes.t_s.values[~used]}, "fixes, %"),
    )
    for axis, table, kinds, label in shown:
        expected = np.diff(edges) / float(settings[table]["period_s"])
        shares = [100 * np.histogram(times, edges)[0] / expected for times in kinds.values()]
        axis.stackplot(edges[:-1] / _HOUR, shares, labels=list(kinds), step="post")
        axis.set_ylabel(label)
        axis.legend(loc="lower right")
    _finish(axes)
    figure.suptitle("Samples and fixes that came, and what was done with them")
    return figure
