"""The main figures of the report, by matplotlib: `pip install trihedron[plots]`. Each gives a figure of its own."""

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

__all__ = ["attitude_uncertainty", "forecast", "open_loop", "parameters", "residuals"]

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
