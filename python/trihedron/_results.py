"""What calibrations, navigations and observations give: arrays of NumPy without copies, datasets of xarray over them."""

from __future__ import annotations

import json
import os
import pathlib
import tomllib
from typing import Any

import numpy as np
import xarray as xr

from . import _native
from ._arrays import Doubles, seconds_since
from ._errors import MachineFailed
from ._pass import COMPONENTS, Pass
from ._settings import PathLike

_SIGMAS = ("sigma_x_rad", "sigma_y_rad", "sigma_z_rad")


def _write(path: PathLike, text: str) -> None:
    target = pathlib.Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, target)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise MachineFailed(
            f"cannot be written: {error.strerror}", "check the directory, its rights and the disk", str(target)
        ) from error


def _time(t_ns: Any, epoch_ns: int) -> xr.Variable:
    attributes = {"units": f"seconds since {_native.format_epoch(epoch_ns)}", "standard_name": "time", "comment": "time scale TAI"}
    return xr.Variable("time", seconds_since(t_ns, epoch_ns), attributes)


def attitude_dataset(its: _native.AttitudeArrays, epoch_ns: int) -> xr.Dataset:
    """Columns as in an attitude file; views of the result that they are of."""
    variables: dict[str, xr.Variable] = {
        name: xr.Variable("time", its.q_in_c[:, i], {"units": "1", "frame": "in_c: v_in = q v_c q*"})
        for i, name in enumerate(COMPONENTS)
    }
    if len(its.sigma_rad):
        for i, name in enumerate(_SIGMAS):
            variables[name] = xr.Variable("time", its.sigma_rad[:, i], {"units": "rad", "frame": "c"})
    if len(its.age_s):
        variables["age_s"] = xr.Variable("time", its.age_s, {"units": "s", "long_name": "time since the last astro-correction"})
    return xr.Dataset(variables, {"t_s": _time(its.t_ns, epoch_ns)})


def errors_dataset(its: _native.AttitudeErrors, epoch_ns: int) -> xr.Dataset:
    """Attitude errors, solution - reference: error_x_rad … and the sigmas of them."""
    variables = {
        f"error_{axis}_rad": xr.Variable("time", its.error_rad[:, i], {"units": "rad", "frame": "c"})
        for i, axis in enumerate("xyz")
    }
    if len(its.sigma_rad):
        for i, name in enumerate(_SIGMAS):
            variables[name] = xr.Variable("time", its.sigma_rad[:, i], {"units": "rad", "frame": "c"})
    return xr.Dataset(variables, {"t_s": _time(its.t_ns, epoch_ns)})


class _Result:
    _its: _native.CalibrationResult | _native.NavigationResult

    @property
    def verdict(self) -> _native.Verdict:
        """Whether the result may be used: verdict.trustworthy; why: verdict.findings."""
        return self._its.verdict

    @property
    def findings(self) -> list[_native.Finding]:
        """What a user of the result must know, each with code, text, evidence, cure and severity."""
        return self.verdict.findings

    @property
    def statistics(self) -> dict[str, float]:
        """Numbers that sum up how it went."""
        return self._its.statistics

    @property
    def forecast(self) -> _native.Forecast | None:
        """Attitude error predicted for an open loop from the end of the pass on; None where no pair of gyros is left there."""
        return self._its.forecast


class Calibration(_Result):
    """A calibration of a pass."""

    _its: _native.CalibrationResult

    def __init__(self, native: _native.CalibrationResult, of: Pass) -> None:
        self._its = native
        #: The pass that was calibrated.
        self.of = of

    @property
    def states(self) -> list[str]:
        """Names of the rows of the covariance: gyro1.k0 …, gyro1.align_x …"""
        return self._its.states

    @property
    def values(self) -> Doubles:
        """Of the states: drift, rad/s; alignment, components of the rotation vector, rad."""
        return self._its.values

    @property
    def covariance(self) -> Doubles:
        """Of the errors of the states, estimate - truth: (rad/s)², rad²; shape (n, n). A view that cannot be written to."""
        return self._its.covariance

    @property
    def sigmas(self) -> Doubles:
        """1-sigma of the states."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def parameters(self) -> xr.Dataset:
        """value and sigma by state."""
        units = np.array(["rad" if ".align" in name else "rad s-1" for name in self.states])
        return xr.Dataset(
            {"value": ("state", self.values), "sigma": ("state", self.sigmas), "units": ("state", units)},
            {"state": np.array(self.states)},
        )

    @property
    def attitude(self) -> xr.Dataset:
        """Of the calibration itself at the fixes: q_x, q_y, q_z, q_w, and sigmas about c x, y, z."""
        return attitude_dataset(self._its.attitude, self._its.epoch_ns)

    @property
    def definitive_attitude(self) -> xr.Dataset:
        """Smoothed, at each gyro sample; without rows unless it was asked for."""
        return attitude_dataset(self._its.definitive_attitude, self._its.epoch_ns)

    @property
    def navigation(self) -> xr.Dataset:
        """Of the navigator at the fixes, corrected now and then."""
        return attitude_dataset(self._its.navigation, self._its.epoch_ns)

    def _table(self, group: str) -> xr.Dataset:
        table = next(its for its in self._its.tables if its.group == group)
        return xr.Dataset(
            {
                its.name: xr.Variable("time", its.values, {"units": its.units, "long_name": its.long_name})
                for its in table.columns
            },
            {"t_s": _time(table.t_ns, self._its.epoch_ns)},
        )

    @property
    def residuals(self) -> xr.Dataset:
        """Of each fix: innovations with their sigmas, NIS, whether it was used; as group fixes of residuals.nc."""
        return self._table("fixes")

    @property
    def history(self) -> xr.Dataset:
        """Estimates along the pass with their sigmas; as group parameters of residuals.nc."""
        return self._table("parameters")

    @property
    def angle(self) -> xr.Dataset:
        """Residual of the angle between the momenta; as group angle of residuals.nc."""
        return self._table("angle")

    @property
    def drift_models(self) -> xr.Dataset:
        """That were compared, by model: coefficients of each gyro, forecast_error_rad (rms of the attitude in open loop over
        the next part of the pass), and log_likelihood of the rest of the pass, above that of the smallest. None where the
        drift is a field, or the smallest was told."""
        names, coefficients, errors, likelihoods = zip(*self._its.drift_models) if self._its.drift_models else ((), (), (), ())
        return xr.Dataset(
            {
                "coefficients": ("model", np.array(coefficients, dtype=int)),
                "forecast_error_rad": ("model", np.array(errors, dtype=float), {"units": "rad"}),
                "log_likelihood": ("model", np.array(likelihoods, dtype=float), {"units": "1"}),
            },
            {"model": np.array(names, dtype=str)},
        )

    @property
    def fix_counts(self) -> dict[str, int]:
        """Fixes by what was done with them."""
        return self._its.fix_counts

    @property
    def sample_counts(self) -> dict[str, int]:
        """Gyro samples by what was done with them."""
        return self._its.sample_counts

    @property
    def settings(self) -> dict[str, Any]:
        """As decided, with nothing left open: fit for `settings` of another call."""
        return tomllib.loads(self._its.settings)

    def to_json(self) -> str:
        """The text of calibration.json, byte for byte that of the program."""
        return self._its.json

    def to_dict(self) -> dict[str, Any]:
        """calibration.json."""
        its: dict[str, Any] = json.loads(self.to_json())
        return its

    def write(self, path: PathLike) -> None:
        """Writes a calibration.json."""
        _write(path, self.to_json())

    def write_attitude(self, path: PathLike, *, definitive: bool = False) -> None:
        """Writes an attitude file (CSV), as the program does."""
        _write(path, self._its.format_attitude(definitive))

    def evaluate(self) -> Evaluation:
        """Errors against the truth of the pass where it has one, else against the star tracker."""
        return Evaluation(_native.evaluate(self._its, self.of._truth_table()), self)

    def __repr__(self) -> str:
        return f"<trihedron.Calibration of {self.of.name}: {self.verdict!r}; {self.forecast!r}>"


class Navigation(_Result):
    """The attitude of a pass by the open-loop navigator."""

    _its: _native.NavigationResult

    def __init__(self, native: _native.NavigationResult, of: Pass) -> None:
        self._its = native
        #: The pass that was flown.
        self.of = of

    @property
    def attitude(self) -> xr.Dataset:
        """At every gyro sample: q_x, q_y, q_z, q_w, sigmas about c x, y, z, age_s."""
        return attitude_dataset(self._its.attitude, self._its.epoch_ns)

    @property
    def corrections(self) -> int:
        """Astro-corrections made."""
        return self._its.corrections

    def write_attitude(self, path: PathLike) -> None:
        """Writes an attitude file (CSV), as the program does."""
        _write(path, self._its.format_attitude())

    def __repr__(self) -> str:
        return f"<trihedron.Navigation of {self.of.name}: {self._its.attitude.t_ns.size} epochs, {self.verdict!r}>"


class Observation:
    """What a pass can tell of the parameters."""

    def __init__(self, native: _native.ObservationResult) -> None:
        self._its = native

    @property
    def parameters(self) -> xr.Dataset:
        """prior_sigma and sigma by parameter; sigma_until: by the measurements up to each of t_s."""
        its = self._its
        return xr.Dataset(
            {
                "prior_sigma": ("parameter", its.prior_sigma),
                "sigma": ("parameter", its.sigma),
                "sigma_until": (("parameter", "time"), its.sigma_until),
            },
            {"parameter": np.array(its.parameters), "t_s": _time(its.t_ns, its.epoch_ns)},
        )

    @property
    def covariance(self) -> Doubles:
        """Of the parameters by prior and measurements; a view that cannot be written to."""
        return self._its.covariance

    @property
    def singular_values(self) -> Doubles:
        """Prior sigma over that by the measurements alone, largest first."""
        return self._its.singular_values

    @property
    def rank(self) -> int:
        """How many combinations are observable."""
        return self._its.rank

    @property
    def attitude_error_rad(self) -> float:
        """rms per axis by what the parameters leave, between corrections and slewing."""
        return self._its.attitude_error_rad

    @property
    def weak(self) -> list[_native.Combination]:
        """Combinations of parameters that the pass tells little of."""
        return self._its.weak

    @property
    def is_harmful(self) -> bool:
        """Whether one of them does harm to the mission."""
        return self._its.is_harmful

    def __repr__(self) -> str:
        return f"<trihedron.Observation: {self.rank} of {len(self.singular_values)} parameters observable, {len(self.weak)} weak>"


class Evaluation:
    """Errors of a calibration's attitudes against a reference."""

    def __init__(self, native: _native.EvaluationResult, of: Calibration) -> None:
        self._its = native
        #: The calibration that was evaluated.
        self.of = of

    @property
    def reference(self) -> str:
        """truth, or star tracker."""
        return self._its.navigation.reference

    @property
    def attitude(self) -> xr.Dataset:
        """Errors of the attitude of the calibration itself, c axes, with the sigmas that it claims."""
        return errors_dataset(self._its.attitude.errors, self._its.epoch_ns)

    @property
    def navigation(self) -> xr.Dataset:
        """Errors of the navigator, likewise."""
        return errors_dataset(self._its.navigation.errors, self._its.epoch_ns)

    @property
    def open_loops(self) -> list[OpenLoop]:
        """Flown from each astro-correction to the end of the pass."""
        return [OpenLoop(its, self._its.epoch_ns) for its in self._its.open_loops]

    @property
    def estimate_minus_truth(self) -> Doubles:
        """By state; empty without a truth."""
        return self._its.estimate_minus_truth


class OpenLoop:
    """The attitude without the star tracker, from an astro-correction to the end of the pass."""

    def __init__(self, native: _native.OpenLoops, epoch_ns: int) -> None:
        self._its = native
        self._epoch_ns = epoch_ns

    @property
    def corrected_s(self) -> float:
        """When the correction was, since the epoch of the pass."""
        return float(seconds_since(np.array([self._its.corrected_ns]), self._epoch_ns)[0])

    @property
    def known_before(self) -> xr.Dataset:
        """Errors with the parameters known before the pass."""
        return errors_dataset(self._its.known_before, self._epoch_ns)

    @property
    def calibrated(self) -> xr.Dataset:
        """Errors with those calibrated until the correction."""
        return errors_dataset(self._its.calibrated, self._epoch_ns)

    @property
    def predicted(self) -> _native.PredictedErrors:
        """What was predicted of the latter."""
        return self._its.predicted
