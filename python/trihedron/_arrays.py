"""Arrays that come in: of numbers, of the right shape, contiguous."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputRefused

Doubles = npt.NDArray[np.float64]

#: Nanoseconds TAI from 1958, where they count from, to 1970, where NumPy's times count from.
_NS_1958_TO_1970 = 378_691_200_000_000_000


def doubles(value: Any, what: str, shape: tuple[int | None, ...]) -> Doubles:
    """As contiguous float64 of this shape, None standing for any length."""
    try:
        array = np.asarray(value)
    except ValueError as error:  # a ragged list
        raise InputRefused(f"{what} is no array: {error}", "give rows of equal length") from None
    if not (np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)):
        raise InputRefused(f"{what} has dtype {array.dtype}", "give real numbers, as float64")
    if array.ndim != len(shape) or any(n is not None and n != its for n, its in zip(shape, array.shape)):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"
        raise InputRefused(f"{what} has shape {array.shape}", f"give an array of shape {wanted}")
    return np.ascontiguousarray(array, dtype=np.float64)


def seconds_since(t_ns: npt.NDArray[np.int64], epoch_ns: int) -> Doubles:
    """Correctly rounded seconds of times in nanoseconds."""
    seconds: Doubles = (t_ns - epoch_ns).astype(np.float64) / 1e9
    return seconds


def nanoseconds(t_s: float, epoch_ns: int, what: str) -> int:
    """The instant of so many seconds since the epoch, to the nearest nanosecond."""
    try:
        seconds = float(t_s)
    except (TypeError, ValueError):
        raise InputRefused(f"{what} is {t_s!r}", "give seconds since the epoch of the pass, as a float") from None
    if not abs(seconds) < 9.2e9:
        raise InputRefused(f"{what} is {seconds}", "give seconds since the epoch of the pass")
    return epoch_ns + int(seconds * 1e9 + (0.5 if seconds >= 0 else -0.5))


def datetime_of(epoch_ns: int) -> np.datetime64:
    """An instant of TAI as NumPy has it, which knows no time scales."""
    return np.datetime64(epoch_ns - _NS_1958_TO_1970, "ns")


def seconds_of_datetimes(t: npt.NDArray[np.datetime64], epoch_ns: int) -> Doubles:
    """Seconds since the epoch of instants of TAI; NaN where there is none."""
    t_ns = t.astype("datetime64[ns]")
    seconds = seconds_since(t_ns.astype(np.int64) + _NS_1958_TO_1970, epoch_ns)
    seconds[np.isnat(t_ns)] = np.nan
    return seconds
