"""The on-board step, event by event."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import doubles, nanoseconds
from ._errors import InputRefused
from ._pass import GyroSample, Pass, Settings, StarFix
from ._settings import CalibrationSettings, PathLike, settings_text


class Pipeline:
    """What flies: gyro samples and fixes go in as they come, attitude and estimates come out.

    of: the settings of a pass, or the pass itself.
    online: parameters are taken over at each astro-correction; False: those of the settings are held.
    settings, keywords: as of calibrate(); what they leave open is settled by what is known before the first event.

    Telemetry may be bad: NaN, times that run backwards, outliers are data, and the report on each event says what was
    done with it. Used by one thread at a time. Raises InputRefused, SetupError.
    """

    def __init__(
        self,
        of: Settings | Pass,
        *,
        online: bool = True,
        settings: PathLike | Mapping[str, Any] | None = None,
        **keywords: Unpack[CalibrationSettings],
    ) -> None:
        its = of.settings if isinstance(of, Pass) else of
        if not isinstance(its, Settings):
            raise InputRefused(f"the settings are a {type(its).__name__}", "give the settings of a pass: p.settings")
        self._epoch_ns = its.epoch_ns
        self._gyros = its.gyros
        self._native = _native.Pipeline(its.toml, its.prior, its.gyros, settings_text(settings, keywords), bool(online))

    def push_gyro(self, t_s: float, directions: npt.ArrayLike) -> list[_native.StepReport]:
        """Direction cosines (gyros, 3) at t_s, seconds since the epoch; what was done with them and, once it is due, with a fix."""
        h = doubles(directions, "directions", (self._gyros, 3))
        return self._native.push_gyro(nanoseconds(t_s, self._epoch_ns, "t_s"), h)

    def push_fix(
        self, t_s: float, q_in_c: npt.ArrayLike, head: int = 0, covariance_rad2: npt.ArrayLike | None = None
    ) -> list[_native.StepReport]:
        """A fix at t_s: x, y, z, w, of star tracker `head`. It is dealt with some samples later.

        covariance_rad2: (3, 3), of its error, c axes; without one the noise of the settings is that of the fix.
        """
        q = doubles(q_in_c, "q_in_c", (4,))
        if isinstance(head, bool) or not isinstance(head, int) or not 0 <= head < self._native.star_trackers:
            raise InputRefused(f"head is {head!r}", f"give 0 … {self._native.star_trackers - 1}, as the settings have them")
        covariance = None
        if covariance_rad2 is not None:
            covariance = doubles(covariance_rad2, "covariance_rad2", (3, 3))
            symmetric = np.allclose(covariance, covariance.T, rtol=1e-9, atol=0)
            if not (symmetric and np.isfinite(covariance).all() and (np.linalg.eigvalsh(covariance) > 0).all()):
                raise InputRefused("covariance_rad2 is no covariance", "give a symmetric, positive definite matrix, rad²")
        return self._native.push_fix(nanoseconds(t_s, self._epoch_ns, "t_s"), q, head, covariance)

    def finish(self) -> list[_native.StepReport]:
        """After the last event: deals with the fixes that still wait."""
        return self._native.finish()

    def feed(self, events: Iterable[GyroSample | StarFix]) -> Iterator[_native.StepReport]:
        """Pushes each event, and yields the reports. `Pass.events()` has those of a pass."""
        for event in events:
            if isinstance(event, GyroSample):
                yield from self.push_gyro(event.t_s, event.directions)
            elif isinstance(event, StarFix):
                yield from self.push_fix(event.t_s, event.q_in_c, event.head, event.covariance_rad2)
            else:
                raise InputRefused(f"an event is a {type(event).__name__}", "give a GyroSample or a StarFix")
        yield from self.finish()

    @property
    def attitude(self) -> _native.Attitude | None:
        """Open-loop attitude at the latest sample with its covariance; None before the first fix was used."""
        return self._native.attitude

    @property
    def started(self) -> bool:
        """Whether a fix has started the calibration."""
        return self._native.started

    @property
    def calibration(self) -> dict[str, Any] | None:
        """Estimates and covariance as of the latest sample, as calibration.json has them; None before the first fix was used."""
        text = self._native.calibration
        return None if text is None else json.loads(text)

    @property
    def settings(self) -> dict[str, Any]:
        """In effect, with nothing left open."""
        return tomllib.loads(self._native.settings)
