"""A pass of telemetry as xarray datasets."""

from __future__ import annotations

import os
import pathlib
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from . import _native
from ._arrays import Doubles, datetime_of, doubles, seconds_of_datetimes, seconds_since
from ._errors import InputRefused, MachineFailed
from ._netcdf import netcdf_as_csv, open_groups
from ._parquet import parquet_as_csv
from ._settings import PathLike, toml_text

AXES = ("x", "y", "z")
COMPONENTS = ("q_x", "q_y", "q_z", "q_w")
COVARIANCES = ("cov_xx_rad2", "cov_yy_rad2", "cov_zz_rad2", "cov_xy_rad2", "cov_xz_rad2", "cov_yz_rad2")
_TIME_COMMENT = "time scale TAI: every second is counted, there are no leap seconds"
_PACKED_FILL = -(2**31)
#: Places of COVARIANCES in a matrix.
_SIX_AS_MATRIX = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])


class GyroSample(NamedTuple):
    """Direction cosines of the momenta at one time."""

    t_s: float  #: since the epoch of the pass
    directions: Doubles  #: shape (gyros, 3), each in its own case axes


class StarFix(NamedTuple):
    """A star-tracker fix."""

    t_s: float  #: since the epoch of the pass
    q_in_c: Doubles  #: x, y, z, w, Hamilton
    head: int = 0  #: which star tracker
    covariance_rad2: Doubles | None = None  #: shape (3, 3), of its error, c axes; None: that of the settings


@dataclass(frozen=True)
class Settings:
    """What pass.toml says of a pass: when and how the telemetry was taken, and what is known before."""

    toml: str  #: text of a pass.toml
    gyros: int
    prior: str = ""  #: text of the calibration.json of an earlier calibration; empty where there is none
    epoch_ns: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "epoch_ns", _epoch_ns(self.to_dict()))

    def to_dict(self) -> dict[str, Any]:
        """The keys of pass.toml."""
        try:
            return tomllib.loads(self.toml)
        except tomllib.TOMLDecodeError as error:
            raise InputRefused(f"the settings are no TOML: {error}", "give the text of a pass.toml") from None


def _epoch_ns(settings: Mapping[str, Any]) -> int:
    table = settings.get("pass")
    epoch = table.get("epoch_tai") if isinstance(table, Mapping) else None
    ns = _native.parse_epoch(epoch) if isinstance(epoch, str) else None
    if ns is None:
        raise InputRefused(
            f"epoch_tai of the settings is {epoch!r}", 'give an ISO date and time in [pass], TAI: epoch_tai = "2009-05-20T00:00:00"'
        )
    return ns


def _star_tracker_name(head: int) -> str:
    return "star_tracker" if head == 0 else f"star_tracker_{head + 1}"


def _direction_names(gyros: int) -> list[str]:
    return [f"h{k + 1}_{axis}" for k in range(gyros) for axis in AXES]


def _attributes(column: str, measured: bool) -> dict[str, str]:
    if column.startswith("q"):
        return {
            "units": "1",
            "long_name": f"attitude quaternion from star-tracker to inertial axes, {column[-1]} component (Hamilton)",
            "frame": "in_c: v_in = q v_c q*",
        }
    if column in COVARIANCES:
        return {
            "units": "rad2",
            "long_name": f"covariance of the error of the fix about the axes {column[4:6]} of c, true = given exp(-error)",
            "frame": "c",
        }
    gyro = column[1:-2]
    return {
        "units": "1",
        "long_name": f"direction cosine {column[-1]} of the angular momentum of gyro {gyro} in "
        + ("its case axes" if measured else "inertial axes"),
        "frame": f"b{gyro}" if measured else "in",
    }


def _dataset(t_s: Doubles, columns: Mapping[str, Doubles], epoch_ns: int, measured: bool = True) -> xr.Dataset:
    time = xr.Variable(
        "time",
        t_s,
        {
            "units": f"seconds since {_native.format_epoch(epoch_ns)}",
            "long_name": "time since the epoch of the pass",
            "standard_name": "time",
            "comment": _TIME_COMMENT,
        },
    )
    return xr.Dataset(
        {name: xr.Variable("time", values, _attributes(name, measured)) for name, values in columns.items()}, {"t_s": time}
    )


def _columns(values: Doubles, names: Sequence[str]) -> dict[str, Doubles]:
    return {name: values[:, i] for i, name in enumerate(names)}


class Pass:
    """One stretch of telemetry: datasets over the dimension `time`, with units and frames in their attributes.

    gyro: h1_x, h1_y, h1_z, h2_x …, direction cosines of the momenta, each in the case axes of its gyro.
    star_trackers: q_x, q_y, q_z, q_w of each head, q_in_c, Hamilton, scalar last; and cov_xx_rad2, yy, zz, xy, xz, yz
        where each fix has its covariance, c axes.
    truth: q_x … and h1_x …, inertial axes, where a simulator wrote them.
    settings: what pass.toml says.

    `t_s` of each is seconds since the epoch, TAI. Rows may be as dirty as telemetry is: they are screened, and what is
    wrong with them is counted, when the pass is used; see `defects`.
    """

    def __init__(
        self,
        settings: Settings | str | Mapping[str, Any],
        gyro: xr.Dataset,
        star_tracker: xr.Dataset | Sequence[xr.Dataset],
        *,
        truth: xr.Dataset | None = None,
        prior: str | Mapping[str, Any] | None = None,
        name: str = "pass",
    ) -> None:
        self.gyro = gyro
        self.star_trackers = [star_tracker] if isinstance(star_tracker, xr.Dataset) else list(star_tracker)
        self.truth = truth
        self.name = name
        self._left_out: list[_native.Defect] = []  # when it was read
        if not isinstance(settings, Settings):
            toml = settings if isinstance(settings, str) else toml_text(settings, "the settings of the pass")
            settings = Settings(toml, _gyros_of(gyro, name), _json_text(prior))
        self.settings = settings

    @classmethod
    def from_arrays(
        cls,
        settings: Settings | str | Mapping[str, Any],
        gyro_t_s: npt.ArrayLike,
        directions: npt.ArrayLike,
        star_tracker_t_s: npt.ArrayLike,
        q_in_c: npt.ArrayLike,
        *,
        prior: str | Mapping[str, Any] | None = None,
        name: str = "pass",
    ) -> Pass:
        """From arrays: times, seconds since the epoch, of shape (n,); directions (n, gyros, 3); q_in_c (m, 4), scalar last."""
        t_s = doubles(gyro_t_s, "gyro_t_s", (None,))
        h = doubles(directions, "directions", (len(t_s), None, 3))
        fix_t_s = doubles(star_tracker_t_s, "star_tracker_t_s", (None,))
        q = doubles(q_in_c, "q_in_c", (len(fix_t_s), 4))
        if not isinstance(settings, Settings):
            toml = settings if isinstance(settings, str) else toml_text(settings, "the settings of the pass")
            settings = Settings(toml, h.shape[1], _json_text(prior))
        gyro = _dataset(t_s, _columns(h.reshape(len(t_s), -1), _direction_names(h.shape[1])), settings.epoch_ns)
        return cls(settings, gyro, _dataset(fix_t_s, _columns(q, COMPONENTS), settings.epoch_ns), name=name)

    @classmethod
    def from_datatree(cls, tree: xr.DataTree, *, name: str = "pass") -> Pass:
        """From groups laid out as in pass.nc: gyro, star_tracker, star_tracker_2 …, truth; times decoded or not."""
        groups = {key: node.to_dataset(inherit=False) for key, node in tree.children.items()}
        return cls._from_groups(dict(tree.attrs), groups, name)

    @classmethod
    def _from_groups(cls, attributes: Mapping[Any, Any], groups: Mapping[str, xr.Dataset], name: str) -> Pass:
        toml = attributes.get("pass_toml")
        if not isinstance(toml, str):
            raise InputRefused('lacks the attribute "pass_toml"', "write it as `trihedron simulate` or Pass.to_netcdf() does", name)
        if "gyro" not in groups or "star_tracker" not in groups:
            missing = "gyro" if "gyro" not in groups else "star_tracker"
            raise InputRefused(f'lacks group "{missing}"', "write it as `trihedron simulate` or Pass.to_netcdf() does", name)
        settings = Settings(toml, _gyros_of(groups["gyro"], name), str(attributes.get("prior_json", "")))
        heads: list[xr.Dataset] = []
        while _star_tracker_name(len(heads)) in groups:
            heads.append(_with_frames(groups[_star_tracker_name(len(heads))], settings, True))
        truth = _with_frames(groups["truth"], settings, False) if "truth" in groups else None
        return cls(settings, _with_frames(groups["gyro"], settings, True), heads, truth=truth, name=name)

    @classmethod
    def _from_tables(cls, tables: _native.Tables, truth: _native.TruthTable | None, name: str) -> Pass:
        settings = Settings(tables.settings, tables.gyros, tables.prior)
        epoch_ns = settings.epoch_ns
        directions = _direction_names(tables.gyros)
        gyro = _dataset(tables.gyro.t_s, _columns(tables.gyro.values(len(directions)), directions), epoch_ns)
        heads = []
        for its in tables.star_trackers:
            columns = [*COMPONENTS, *(COVARIANCES if its.has_covariances else ())]
            heads.append(_dataset(its.t_s, _columns(its.values(len(columns)), columns), epoch_ns))
        true = None
        if truth is not None:
            names = [*COMPONENTS, *_direction_names(truth.gyros)]
            true = _dataset(truth.table.t_s, _columns(truth.table.values(len(names)), names), epoch_ns, measured=False)
            true.attrs["truth_json"] = truth.parameters
        return cls(settings, gyro, heads, truth=true, name=name)

    @property
    def star_tracker(self) -> xr.Dataset:
        """Of the first head, whose axes are c."""
        return self.star_trackers[0]

    @property
    def epoch(self) -> np.datetime64:
        """Of t_s, TAI: NumPy knows no leap seconds, so that this is not UTC."""
        return datetime_of(self.settings.epoch_ns)

    @property
    def defects(self) -> list[_native.Defect]:
        """What is wrong with the telemetry, by kind and place: rows that are left out, and rows that are not usable."""
        return [*self._left_out, *self._screened().defects]

    def events(self) -> Iterator[GyroSample | StarFix]:
        """The screened telemetry as the spacecraft has it: in time order, a fix after the gyro sample of the same time."""
        screened = self._screened()
        epoch_ns = self.settings.epoch_ns
        heads = range(screened.heads)
        # kind 0: gyros; 1, 2 …: heads.
        t_ns = np.concatenate([screened.gyro_ns, *(screened.fix_ns(head) for head in heads)])
        kind = np.concatenate(
            [np.zeros(len(screened.gyro_ns), int), *(np.full(len(screened.fix_ns(head)), head + 1) for head in heads)]
        )
        row = np.concatenate([np.arange(len(screened.gyro_ns)), *(np.arange(len(screened.fix_ns(head))) for head in heads)])
        directions = screened.directions
        quaternions = [screened.q_in_c(head) for head in heads]
        covariances = [screened.covariances_rad2(head) for head in heads]
        for i in np.lexsort((kind, t_ns)):
            t_s = float(seconds_since(t_ns[i], epoch_ns))
            if kind[i] == 0:
                yield GyroSample(t_s, directions[row[i]])
            else:
                head = int(kind[i] - 1)
                six = covariances[head]
                covariance = six[row[i]][_SIX_AS_MATRIX] if six is not None and six[row[i], 0] > 0 else None
                yield StarFix(t_s, quaternions[head][row[i]], head, covariance)

    def to_datatree(self) -> xr.DataTree:
        """Groups laid out as in pass.nc."""
        root = xr.Dataset(
            attrs={
                "Conventions": "CF-1.8",
                "title": "Telemetry of electrostatic gyros and a star tracker",
                "spacecraft": str(self.settings.to_dict()["pass"].get("spacecraft", "")),
                "epoch_tai": _native.format_epoch(self.settings.epoch_ns),
                "pass_toml": self.settings.toml,
            }
        )
        if self.settings.prior:
            root.attrs["prior_json"] = self.settings.prior
        groups = {"/": root, "gyro": self.gyro}
        groups.update({_star_tracker_name(head): its for head, its in enumerate(self.star_trackers)})
        if self.truth is not None:
            groups["truth"] = self.truth
        return xr.DataTree.from_dict(groups)

    def to_netcdf(self, path: PathLike) -> None:
        """Writes a pass.nc that the program reads; all of it or nothing."""
        target = pathlib.Path(path)
        tree = self.to_datatree()
        try:
            with tempfile.TemporaryDirectory(dir=target.parent, prefix=".trihedron-") as directory:
                temporary = pathlib.Path(directory) / target.name
                tree.to_netcdf(temporary, engine="h5netcdf")
                os.replace(temporary, target)
        except OSError as error:
            raise MachineFailed(
                f"cannot be written: {error.strerror or error}", "check the directory, its rights and the disk", str(target)
            ) from error

    def _screened(self) -> _native.ScreenedPass:
        epoch_ns = self.settings.epoch_ns
        names = _direction_names(self.settings.gyros)
        t_s, values = _rows(self.gyro, names, "gyro", epoch_ns)
        tables = _native.Tables(self.name, self.settings.toml, self.settings.prior, self.settings.gyros, t_s, values)
        for head, dataset in enumerate(self.star_trackers):
            name = _star_tracker_name(head)
            if not any(column in dataset.variables for column in COVARIANCES):
                tables.add_star_tracker(name, *_rows(dataset, COMPONENTS, name, epoch_ns))
                continue
            diagonal = not any(column in dataset.variables for column in COVARIANCES[3:])
            t_s, values = _rows(dataset, [*COMPONENTS, *(COVARIANCES[:3] if diagonal else COVARIANCES)], name, epoch_ns)
            tables.add_star_tracker(name, t_s, np.hstack([values, np.zeros((len(t_s), 3))]) if diagonal else values)
        return _native.screened(tables)

    def _truth_table(self) -> _native.TruthTable | None:
        if self.truth is None:
            return None
        gyros = _gyros_of(self.truth, "truth")
        t_s, values = _rows(self.truth, [*COMPONENTS, *_direction_names(gyros)], "truth", self.settings.epoch_ns)
        return _native.TruthTable(str(self.truth.attrs.get("truth_json", "")), gyros, t_s, values)

    def __repr__(self) -> str:
        heads = "" if len(self.star_trackers) == 1 else f" of {len(self.star_trackers)} star trackers"
        fixes = sum(its.sizes.get("time", 0) for its in self.star_trackers)
        return (
            f"<trihedron.Pass {self.name}: {_native.format_epoch(self.settings.epoch_ns)} TAI, {self.settings.gyros} gyros, "
            f"{self.gyro.sizes.get('time', 0)} samples, {fixes} fixes{heads}{', truth' if self.truth is not None else ''}>"
        )


def _json_text(prior: str | Mapping[str, Any] | None) -> str:
    if prior is None or isinstance(prior, str):
        return prior or ""
    import json

    return json.dumps(prior)


def _gyros_of(dataset: xr.Dataset, name: str) -> int:
    gyros = 0
    while all(f"h{gyros + 1}_{axis}" in dataset for axis in AXES):
        gyros += 1
    stray = [str(key) for key in dataset.data_vars if str(key).startswith("h") and str(key) not in _direction_names(gyros)]
    if gyros == 0 or stray:
        what = f"has a column {stray[0]}, but not all of its gyro" if stray else "has no columns h1_x, h1_y, h1_z"
        raise InputRefused(what, "give h1_x, h1_y, h1_z, h2_x … without a gap", f"{name}:gyro")
    return gyros


def _with_frames(dataset: xr.Dataset, settings: Settings, measured: bool) -> xr.Dataset:
    """With attributes for what a file leaves to its format."""
    dataset = dataset.copy()
    for name in dataset.data_vars:
        if str(name) in (*COMPONENTS, *COVARIANCES, *_direction_names(settings.gyros)):
            dataset[name].attrs = {**_attributes(str(name), measured), **dataset[name].attrs}
    return dataset


def _rows(dataset: xr.Dataset, names: Sequence[str], what: str, epoch_ns: int) -> tuple[Doubles, Doubles]:
    """Times, seconds since the epoch, and columns side by side."""
    missing = [name for name in ("t_s", *names) if name not in dataset.variables]
    if missing:
        raise InputRefused(f"lacks the variable {missing[0]}", f"give {', '.join(('t_s', *names))}", what)
    for name in names:
        expected = "rad2" if name in COVARIANCES else "1"
        units = dataset[name].attrs.get("units", expected)
        if units not in (expected, ""):
            raise InputRefused(
                f"{name} has units {units!r}",
                'convert the values to rad², and give units "rad2"'
                if name in COVARIANCES
                else 'direction cosines and quaternions have none: convert the values, and give units "1"',
                what,
            )
    raw = dataset["t_s"].values
    if np.issubdtype(raw.dtype, np.datetime64):
        t_s = seconds_of_datetimes(raw, epoch_ns)
    else:
        _expect_units_of_time(dataset["t_s"].attrs.get("units", "seconds"), epoch_ns, what)
        t_s = doubles(raw, f"t_s of {what}", (None,))
    columns = [doubles(dataset[name].values, f"{name} of {what}", (len(t_s),)) for name in names]
    return t_s, np.ascontiguousarray(np.stack(columns, axis=1)) if columns else np.empty((len(t_s), 0))


def _expect_units_of_time(units: str, epoch_ns: int, what: str) -> None:
    since = units.removeprefix("seconds since ").replace(" ", "T")
    since += "T00:00:00" if len(since) == 10 else ""
    if units not in ("seconds", "s") and _native.parse_epoch(since) != epoch_ns:
        raise InputRefused(
            f"t_s has units {units!r}",
            f'they must be "seconds since {_native.format_epoch(epoch_ns)}", the epoch of the pass',
            what,
        )


def _table_as_csv(file: str, names: Sequence[str]) -> str:
    is_parquet = pathlib.Path(file).suffix in (".parquet", ".pq")
    return parquet_as_csv(file, names) if is_parquet else netcdf_as_csv(file, names)


def read_pass(path: PathLike) -> Pass:
    """Reads a pass: a directory with pass.toml, gyro.csv and star_tracker.csv, a NetCDF-4 file, by xarray, or a
    telemetry.toml, which says where others' CSV, NetCDF and Parquet files have its columns; Parquet needs pyarrow.

    Raises InputRefused for what cannot be understood, with file, line, reason and cure.
    """
    file = pathlib.Path(path)
    if file.is_dir():
        tables = _native.read_tables(str(file))
        return Pass._from_tables(tables, _native.read_truth(str(file), _epoch_ns(tomllib.loads(tables.settings))), str(file))
    if not file.is_file():
        raise InputRefused(
            "there is no such file or directory",
            "give a pass: a directory with pass.toml, gyro.csv and star_tracker.csv, a NetCDF-4 file, or a telemetry.toml",
            str(file),
        )
    if file.suffix == ".toml":
        tables, left_out = _native.read_telemetry(str(file), _table_as_csv)
        its = Pass._from_tables(tables, None, str(file))
        its._left_out = left_out
        return its
    groups = open_groups(
        str(file), "give a pass: a directory with pass.toml, gyro.csv and star_tracker.csv, or a NetCDF-4 file", decode_times=False
    )
    return Pass._from_groups(dict(groups.pop("").attrs), groups, str(file))


#: The same, by the name that users of xarray look for.
open_pass = read_pass


def packed(dataset: xr.Dataset, step: float) -> xr.Dataset:
    """With the encoding of the program's files: 32-bit integers in these steps."""
    for name in dataset.data_vars:
        dataset[name].encoding = {"dtype": "int32", "scale_factor": step, "_FillValue": _PACKED_FILL}
    return dataset
