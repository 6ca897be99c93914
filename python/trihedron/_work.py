"""The work: simulate, calibrate, navigate, observe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Unpack

from . import _native
from ._errors import InputRefused
from ._pass import Pass, packed
from ._results import Calibration, Navigation, Observation
from ._settings import CalibrationSettings, PathLike, scenario_text, settings_text

#: Called now and then with the fraction done, 0 … 1, in the thread that asked for the work; what it raises ends the work.
Progress = Callable[[float], object]


def _expect_pass(value: object) -> Pass:
    if not isinstance(value, Pass):
        raise InputRefused(f"the pass is a {type(value).__name__}", "give a trihedron.Pass: read_pass(), Pass.from_arrays()")
    return value


def _expect_callable(progress: object) -> None:
    if progress is not None and not callable(progress):
        raise InputRefused(f"progress is a {type(progress).__name__}", "give a function of the fraction done, or None")


def simulate(
    scenario: PathLike | Mapping[str, Any], *, seed: int | None = None, progress: Progress | None = None
) -> Pass:
    """The pass of a scenario, with its truth: a TOML file, or a dictionary with its keys.

    seed: goes before that of the scenario. The same scenario and seed give the same pass, bit for bit that of
    `trihedron simulate SCENARIO -o pass.nc`. Raises InputRefused.
    """
    _expect_callable(progress)
    if seed is not None and (isinstance(seed, bool) or not isinstance(seed, int) or seed < 0):
        raise InputRefused(f"seed is {seed!r}", "give a whole number, 0 or more")
    text, name = scenario_text(scenario, seed)
    made = _native.simulate(text, name, progress)
    result = Pass._from_tables(made.tables, made.truth, name)
    packed(result.gyro, made.direction_step)
    return result


def calibrate(
    of: Pass,
    *,
    definitive: bool = False,
    settings: PathLike | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    **keywords: Unpack[CalibrationSettings],
) -> Calibration:
    """Calibrates drift and alignment of the gyros against the star tracker.

    definitive: the smoothed attitude at each gyro sample as well, by estimator batch.
    settings: a settings file, or a dictionary with its keys. Keywords are the same keys, and go before it:
    estimator="batch", drift_model="esg20", need="5arcmin for 270min", filter={"gate_nis": 40},
    corrections={"interval": "90min"}.

    Other threads of Python run meanwhile; Ctrl-C ends it. Raises InputRefused, SetupError.
    """
    _expect_pass(of)
    _expect_callable(progress)
    if definitive:
        keywords = {**keywords, "estimator": "batch"}
    text = settings_text(settings, keywords)
    return Calibration(_native.calibrate(of._screened(), text, bool(definitive), progress), of)


def navigate(
    of: Pass,
    *,
    calibration: Calibration | Mapping[str, Any] | PathLike | None = None,
    online: bool | None = None,
    correction_interval: str | None = None,
    settings: PathLike | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    **keywords: Unpack[CalibrationSettings],
) -> Navigation:
    """The attitude at every gyro sample by the navigator, from nothing that comes later.

    calibration: its values are held; a Calibration, its dictionary, or a calibration.json.
    online: calibrate along, and take over the estimates at each correction; so unless a calibration is given. False
    without a calibration holds what the settings of the pass say.
    correction_interval: between astro-corrections: "90min", "none" (only the first), "continuous" (each fix).
    settings, progress, keywords: as of calibrate(). Raises InputRefused, SetupError.
    """
    _expect_pass(of)
    _expect_callable(progress)
    if calibration is not None and online:
        raise InputRefused("online and calibration exclude each other", "hold the values of the calibration, or calibrate along")
    if correction_interval is not None:
        given = keywords.get("corrections", {})
        keywords = {**keywords, "corrections": {**given, "interval": correction_interval}}
    text = settings_text(settings, keywords)
    held = _calibration_text(calibration) if calibration is not None else None
    takes = calibration is None if online is None else online
    return Navigation(_native.navigate(of._screened(), text, takes, held, progress), of)


def _calibration_text(calibration: Calibration | Mapping[str, Any] | PathLike) -> str:
    import json
    import pathlib

    if isinstance(calibration, Calibration):
        return calibration.to_json()
    if isinstance(calibration, Mapping):
        return json.dumps(calibration)
    try:
        return pathlib.Path(calibration).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputRefused(f"cannot be read: {error}", "give a calibration.json", str(calibration)) from None


def observe(
    of: Pass | PathLike | Mapping[str, Any],
    *,
    settings: PathLike | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    **keywords: Unpack[CalibrationSettings],
) -> Observation:
    """What a pass, or the pass of a scenario, can tell of the parameters, whatever was known before.

    settings, keywords: as of calibrate(). Raises InputRefused, SetupError.
    """
    _expect_callable(progress)
    flown = of if isinstance(of, Pass) else simulate(of)
    return Observation(_native.observe(flown._screened(), settings_text(settings, keywords), progress))
