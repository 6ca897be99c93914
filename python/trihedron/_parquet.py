"""Columns of a Parquet file, as the text of a CSV file: what reads others' CSV files then reads those of Parquet."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

from ._errors import InputRefused


def parquet_as_csv(file: str, names: Sequence[str]) -> str:
    """Names in the first line, an empty field where there is no value, timestamps as ISO dates and times.

    NAME[0] is the first element of a column of lists, NAME.PART a part of one of structures. Where a column is
    missing, the names that there are, without rows. Raises InputRefused.
    """
    try:
        pa = importlib.import_module("pyarrow")
        parquet = importlib.import_module("pyarrow.parquet")
        csv = importlib.import_module("pyarrow.csv")
    except ImportError:
        raise InputRefused("is Parquet, and pyarrow is not installed", "pip install 'trihedron[parquet]'", file) from None
    try:
        with parquet.ParquetFile(file) as its:
            known = its.schema_arrow.names
            wanted = sorted({top for top in (_top(name, known) for name in names) if top is not None})
            table = its.read(columns=wanted)
        columns = {name: _column(table, name) for name in dict.fromkeys(names)}
        missing = [name for name, column in columns.items() if column is None]
        if missing:
            there = [name for name in columns if name not in missing]
            return ",".join('"' + name.replace('"', "") + '"' for name in dict.fromkeys([*there, *known])) + "\n"
        sink = pa.BufferOutputStream()
        csv.write_csv(pa.table({name: _plain(pa, column, name, file) for name, column in columns.items()}), sink)
        text: str = sink.getvalue().to_pybytes().decode("utf-8")
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())
        raise InputRefused(f"is no Parquet file that pyarrow can read ({reason})", "write it again", file) from None
    return text


def _top(name: str, known: Sequence[str]) -> str | None:
    """The column of the file that `name` is, or is a part of."""
    return name if name in known else next((top for top in known if name.startswith((top + "[", top + "."))), None)


def _column(table: Any, name: str) -> Any:
    """None where there is no such column."""
    compute = importlib.import_module("pyarrow.compute")
    if name in table.column_names:
        return table.column(name)
    top = _top(name, table.column_names)
    if top is None:
        return None
    column = table.column(top)
    rest = name[len(top) :]
    if rest.startswith("[") and rest.endswith("]") and rest[1:-1].isdigit() and "list" in str(column.type):
        lengths = compute.unique(compute.drop_null(compute.list_value_length(column)))
        if any(int(rest[1:-1]) >= length.as_py() for length in lengths):
            return None
        return compute.list_element(column, int(rest[1:-1]))
    if rest.startswith(".") and "struct" in str(column.type):
        parts = [field.name for field in column.type]
        return compute.struct_field(column, rest[1:]) if rest[1:] in parts else None
    return None


def _plain(pa: Any, column: Any, name: str, file: str) -> Any:
    """As the text of a CSV file has it."""
    types = pa.types
    if types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    if types.is_boolean(column.type):
        return column.cast(pa.uint8())
    if types.is_decimal(column.type) or types.is_floating(column.type):
        return column.cast(pa.float64())
    if types.is_timestamp(column.type) and column.type.tz not in (None, "UTC", "+00:00", "Etc/UTC"):
        # An instant all the same: pyarrow would write it as the clock of that zone shows it.
        return column.cast(pa.timestamp(column.type.unit, "UTC"))
    simple = types.is_integer, types.is_floating, types.is_timestamp, types.is_string, types.is_large_string
    if not any(its(column.type) for its in simple):
        raise InputRefused(
            f'column "{name}" is of type {column.type}, which stands for no number and no time',
            "name a column of numbers, timestamps or texts; NAME[0] is the first element of a list",
            file,
        )
    return column
