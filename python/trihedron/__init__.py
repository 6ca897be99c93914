"""Calibration of electrostatic gyros against a star tracker, and the attitude that they give.

    import trihedron
    p = trihedron.read_pass("pass.nc")
    r = trihedron.calibrate(p, estimator="invariant")
    r.verdict, r.attitude, r.to_dict()

Times are seconds since the epoch of a pass, TAI; angles radians; quaternions q_in_c, Hamilton, scalar last.
"""

from . import _accessor as _accessor
from ._errors import InputRefused, MachineFailed, SetupError, TrihedronError
from ._native import version as __version__
from ._pass import GyroSample, Pass, Settings, StarFix, open_pass, read_pass
from ._pipeline import Pipeline
from ._results import Calibration, Evaluation, Navigation, Observation, OpenLoop
from ._work import calibrate, navigate, observe, simulate

__all__ = [
    "Calibration",
    "Evaluation",
    "GyroSample",
    "InputRefused",
    "MachineFailed",
    "Navigation",
    "Observation",
    "OpenLoop",
    "Pass",
    "Pipeline",
    "Settings",
    "SetupError",
    "StarFix",
    "TrihedronError",
    "__version__",
    "calibrate",
    "navigate",
    "observe",
    "open_pass",
    "read_pass",
    "simulate",
]
