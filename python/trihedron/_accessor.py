"""`tree.trihedron`: what can be done with a pass.nc that xarray has opened."""

from __future__ import annotations

from typing import Any

import xarray as xr

from . import _work
from ._pass import Pass
from ._pipeline import Pipeline
from ._results import Calibration, Navigation, Observation


@xr.register_datatree_accessor("trihedron")  # type: ignore[no-untyped-call, untyped-decorator, unused-ignore]
class PassAccessor:
    """Of a DataTree laid out as pass.nc: `xarray.open_datatree("pass.nc").trihedron.calibrate()`."""

    def __init__(self, tree: xr.DataTree) -> None:
        self._tree = tree

    @property
    def as_pass(self) -> Pass:
        """The same as a Pass, without copies of its data."""
        return Pass.from_datatree(self._tree, name=self._tree.name or "pass")

    def calibrate(self, **keywords: Any) -> Calibration:
        """As trihedron.calibrate()."""
        return _work.calibrate(self.as_pass, **keywords)

    def navigate(self, **keywords: Any) -> Navigation:
        """As trihedron.navigate()."""
        return _work.navigate(self.as_pass, **keywords)

    def observe(self, **keywords: Any) -> Observation:
        """As trihedron.observe()."""
        return _work.observe(self.as_pass, **keywords)

    def pipeline(self, **keywords: Any) -> Pipeline:
        """As trihedron.Pipeline()."""
        return Pipeline(self.as_pass, **keywords)
