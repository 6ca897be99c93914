"""NetCDF files by xarray; columns of others' as the text of a CSV file, which is read as others' CSV files are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ._arrays import Doubles
from ._errors import InputRefused


def open_groups(file: str, cure: str, **options: Any) -> dict[str, xr.Dataset]:
    """Groups by their paths, "" for the root, in memory. options: of xarray.open_groups(). Raises InputRefused."""
    try:
        groups = {key.strip("/"): its.load() for key, its in xr.open_groups(file, engine="h5netcdf", **options).items()}
    except Exception as error:  # of whatever kind: h5netcdf, h5py and xarray have no common one for damaged files
        reason = " ".join(str(error).split())
        raise InputRefused(f"is no NetCDF-4 file that xarray can read ({reason})", cure, file) from error
    for dataset in groups.values():
        dataset.close()
    return groups


def netcdf_as_csv(file: str, names: Sequence[str]) -> str:
    """Names in the first line, nan where there is no value.

    GROUP/NAME is a variable along one dimension, GROUP/NAME[0] column 0 of one with two. Where one is missing, the names that
    there are, without rows. Raises InputRefused.
    """
    groups = open_groups(file, "write it again", decode_cf=False)
    known = [f"{group}/{name}".strip("/") for group, its in groups.items() for name in map(str, its.variables)]
    columns = {name: _column(groups, name, file) for name in dict.fromkeys(names)}
    there = [name for name, column in columns.items() if column is not None]
    if len(there) < len(columns):
        return ",".join('"' + name.replace('"', "") + '"' for name in dict.fromkeys([*there, *known])) + "\n"
    lists = {name: column.tolist() for name, column in columns.items() if column is not None}
    first = next(iter(lists))
    for name, values in lists.items():
        if len(values) != len(lists[first]):
            raise InputRefused(
                f'variable "{name}" has {len(values)} rows, "{first}" has {len(lists[first])}',
                "the columns of a table must have the same length",
                file,
            )
    rows = zip(*(map(repr, values) for values in lists.values()))
    return "\n".join([",".join(f'"{name}"' for name in lists), *map(",".join, rows)]) + "\n"


def _column(groups: dict[str, xr.Dataset], path: str, file: str) -> Doubles | None:
    """Unpacked; None where there is no such variable."""
    whole, bracket, index = path.removesuffix("]").rpartition("[") if path.endswith("]") else (path, "", "")
    group, _, name = whole.rpartition("/")
    if group.strip("/") not in groups or name not in groups[group.strip("/")].variables:
        return None
    its = groups[group.strip("/")].variables[name]
    expected = 2 if bracket else 1
    if its.ndim != expected:
        raise InputRefused(
            f'variable "{path}" has {its.ndim} dimension{"" if its.ndim == 1 else "s"}, not {expected}',
            "a column has one; name column 0 of a variable with two as NAME[0]",
            file,
        )
    if its.dtype.kind not in "iuf":
        raise InputRefused(f'variable "{path}" does not hold numbers', "name one of numbers", file)
    if bracket and not (index.isdecimal() and int(index) < its.shape[1]):
        raise InputRefused(
            f'variable "{path}" has no such column', f"it has {its.shape[1]} of them, counted from 0", file
        )
    values = np.asarray(its.values[:, int(index)] if bracket else its.values, dtype=np.float64)
    scale, offset, fill = (its.attrs.get(key) for key in ("scale_factor", "add_offset", "_FillValue"))
    unpacked = values * (1.0 if scale is None else float(scale)) + (0.0 if offset is None else float(offset))
    result: Doubles = unpacked if fill is None else np.where(values == float(fill), np.nan, unpacked)
    return result
