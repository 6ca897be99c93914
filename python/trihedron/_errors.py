"""What can go wrong. Each error says where, why, and what to do about it."""

from __future__ import annotations


class TrihedronError(Exception):
    """Base of all errors of this package.

    reason: what is wrong.
    cure: what to do about it.
    file, line, column: where, counted from 1; None and 0 where there is no such place.
    """

    def __init__(self, reason: str, cure: str, file: str | None = None, line: int = 0, column: int = 0) -> None:
        place = "".join(f"{part}:" for part in (file, line or None, column or None) if part is not None)
        super().__init__(f"{place} {reason}; {cure}" if place else f"{reason}; {cure}")
        self.reason = reason
        self.cure = cure
        self.file = file
        self.line = line
        self.column = column

    def __reduce__(self) -> tuple[type, tuple[str, str, str | None, int, int]]:
        return type(self), (self.reason, self.cure, self.file, self.line, self.column)


class InputRefused(TrihedronError, ValueError):
    """A file, an array or a setting that cannot be understood."""


class SetupError(TrihedronError, ValueError):
    """A pass or settings that cannot work: too few gyros, no usable fix, a prior that is no covariance."""


class MachineFailed(TrihedronError):
    """The disk or the system failed."""
