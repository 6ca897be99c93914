"""Settings and scenarios, which the program has as TOML, from keywords, dictionaries and files."""

from __future__ import annotations

import os
import pathlib
import tomllib
from collections.abc import Mapping
from typing import Any, TypedDict

import tomli_w

from ._errors import InputRefused

PathLike = str | os.PathLike[str]


class CalibrationSettings(TypedDict, total=False):
    """The keys of a settings file; `trihedron schema config` describes each."""

    estimator: str
    drift_model: str
    need: str
    filter: dict[str, Any]
    further_states: dict[str, Any]
    corrections: dict[str, Any]


def toml_text(table: Mapping[str, Any], what: str) -> str:
    """A dictionary as TOML."""
    try:
        return tomli_w.dumps(table)
    except (TypeError, ValueError, AttributeError) as error:
        raise InputRefused(f"{what} cannot be TOML: {error}", "give texts, numbers, lists and dictionaries") from None


def table_of(source: PathLike | Mapping[str, Any], what: str) -> dict[str, Any]:
    """A dictionary, or what a TOML file holds."""
    if isinstance(source, Mapping):
        return dict(source)
    file = pathlib.Path(source)
    try:
        with file.open("rb") as its:
            return tomllib.load(its)
    except OSError as error:
        raise InputRefused(f"cannot be opened: {error.strerror}", f"give {what}", str(file)) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputRefused(str(error), "repair the TOML syntax", str(file)) from None


def settings_text(settings: PathLike | Mapping[str, Any] | None, keywords: Mapping[str, Any]) -> str:
    """Settings of a file or dictionary, and keywords that go before them."""
    table = table_of(settings, "a settings file (TOML)") if settings is not None else {}
    for key, value in keywords.items():
        both_tables = isinstance(value, Mapping) and isinstance(table.get(key), Mapping)
        table[key] = {**table[key], **value} if both_tables else value
    return toml_text(table, "the settings")


def scenario_text(scenario: PathLike | Mapping[str, Any], seed: int | None) -> tuple[str, str]:
    """The text of a scenario, and the name that messages give it."""
    name = "scenario" if isinstance(scenario, Mapping) else str(pathlib.Path(scenario))
    if seed is None and not isinstance(scenario, Mapping):
        try:
            return pathlib.Path(scenario).read_text(encoding="utf-8"), name  # so that messages have its lines
        except OSError as error:
            raise InputRefused(f"cannot be opened: {error.strerror}", "give a scenario (TOML)", name) from None
        except UnicodeDecodeError as error:
            raise InputRefused(f"is no UTF-8: {error.reason}", "give a scenario (TOML)", name) from None
    table = table_of(scenario, "a scenario (TOML)")
    if seed is not None:
        head = table.get("scenario", {})
        if not isinstance(head, Mapping):
            raise InputRefused('"scenario" is no table', "give [scenario] with duration, seed and so on", name)
        table["scenario"] = {**head, "seed": seed}
    return toml_text(table, "the scenario"), name
