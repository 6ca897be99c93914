"""A telemetry.toml whose tables are Parquet is the pass that the program makes of the same tables as CSV."""
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest

import trihedron
from conftest import MAP_HEAD, program
from same_as_program_test import same_telemetry

MAP = MAP_HEAD + """[telemetry.time]
scale = "UTC"
format = "iso"
[telemetry.gyro]
file = "gyro.ENDING"
time_column = "stamp"
[[telemetry.gyro.unit]]
direction = ["H1<0>", "H1<1>", "H1<2>"]
flag = "good"
good = [1]
[[telemetry.gyro.unit]]
direction = ["h2_x", "h2_y", "-h2_z"]
[telemetry.star_tracker]
file = "star_tracker.ENDING"
time_column = "stamp"
quaternion = ["Q<0>", "Q<1>", "Q<2>", "Q<3>"]
scalar = "last"
maps = "tracker-to-inertial"
sigma = ["sigma_x", "sigma_y", "sigma_z"]
sigma_unit = "urad"
[[telemetry.exclude]]
file = "slews.ENDING"
begin_column = "begin"
end_column = "end"
"""


def stamps(table):
    """UTC of a pass whose epoch is 2009-05-20T00:00:00 TAI: 34 s of leap seconds."""
    ns = np.round(table.t_s.values * 1e9).astype("int64")
    return (np.datetime64("2009-05-19T23:59:26", "ns") + ns.astype("timedelta64[ns]")).astype("datetime64[ns]")


@pytest.fixture(scope="module")
def tables(flown):
    """Of ten minutes, which are enough to be read in each way."""
    gyro, fixes = (its.isel(time=its.t_s.values < 600) for its in (flown.gyro, flown.star_tracker))
    h1 = np.stack([gyro[f"h1_{axis}"].values for axis in "xyz"], axis=1)
    good = np.arange(len(h1)) % 50 != 3
    q = np.stack([fixes[f"q_{axis}"].values for axis in "xyzw"], axis=1)
    sigma = np.tile(np.float32([15.5, 15.5, 97.1]), (len(q), 1))
    sigma[-7] = 200
    missing = pa.array(gyro.h2_x.values, mask=np.arange(len(h1)) == 11)
    edges = stamps(gyro).astype("datetime64[us]")
    return {
        "gyro": {"stamp": pa.array(stamps(gyro), pa.timestamp("ns", "UTC")), "H1": pa.FixedSizeListArray.from_arrays(pa.array(h1.ravel()), 3),
                  "h2_x": missing, "h2_y": pa.array(gyro.h2_y.values), "h2_z": pa.array(-gyro.h2_z.values), "good": pa.array(good)},
        "star_tracker": {"stamp": pa.array(stamps(fixes)), "Q": pa.array(list(q)), **{f"sigma_{axis}": pa.array(sigma[:, i])
                                                                                        for i, axis in enumerate("xyz")}},
        "slews": {"begin": pa.array(edges[100:101]), "end": pa.array(edges[180:181])},
    }


@pytest.fixture(scope="module")
def directory(tables, tmp_path_factory):
    """The same tables as Parquet with lists, and as CSV with a column for each element."""
    path = tmp_path_factory.mktemp("parquet")
    for name, columns in tables.items():
        pyarrow.parquet.write_table(pa.table(columns), path / f"{name}.parquet")
        flat = {}
        for key, column in columns.items():
            if pa.types.is_nested(column.type):
                rows = np.array(column.to_pylist())
                flat |= {f"{key}_{i}": pa.array(rows[:, i]) for i in range(rows.shape[1])}
            elif column.type == pa.bool_():
                flat[key] = column.cast(pa.uint8())
            else:
                flat[key] = column.cast(pa.float64()) if pa.types.is_float32(column.type) else column
        pyarrow.csv.write_csv(pa.table(flat), path / f"{name}.csv")
    (path / "csv.toml").write_text(MAP.replace("ENDING", "csv").replace("<", "_").replace(">", ""))
    (path / "parquet.toml").write_text(MAP.replace("ENDING", "parquet").replace("<", "[").replace(">", "]"))
    return path


def test_is_what_the_program_makes_of_the_same_tables_as_csv(directory):
    program("import", directory / "csv.toml", "-o", directory / "pass.nc")
    of_parquet = trihedron.read_pass(directory / "parquet.toml")
    same_telemetry(of_parquet, trihedron.read_pass(directory / "pass.nc"))
    same_telemetry(of_parquet, trihedron.read_pass(directory / "csv.toml"))
    assert of_parquet.star_tracker.cov_zz_rad2.values.max() == pytest.approx(200e-6**2)
    kinds = [its.kind for its in of_parquet.defects]
    assert "flagged" in kinds and "excluded" in kinds and kinds.count("missing-value") > 0
    of_parquet.to_netcdf(directory / "again.nc")
    same_telemetry(of_parquet, trihedron.read_pass(directory / "again.nc"))


def test_the_covariances_of_the_fixes_are_used_as_by_the_program(directory):
    flown = trihedron.read_pass(directory / "parquet.toml")
    flown.to_netcdf(directory / "flown.nc")
    program("calibrate", directory / "flown.nc", "-o", directory / "out")
    result = trihedron.calibrate(flown)
    assert result.to_json() == (directory / "out" / "calibration.json").read_text()
    alike = trihedron.Pass(flown.settings, flown.gyro, flown.star_tracker[["q_x", "q_y", "q_z", "q_w"]])
    assert trihedron.calibrate(alike).to_json() != result.to_json()
    # Event by event as well.
    told = [event for event in flown.events() if isinstance(event, trihedron.StarFix)]
    assert told[0].covariance_rad2 == pytest.approx(np.diag(np.float64(np.float32([15.5, 15.5, 97.1])) ** 2 * 1e-12))
    pipelines = [trihedron.Pipeline(flown), trihedron.Pipeline(flown)]
    for pipeline, its in zip(pipelines, (flown, alike)):
        assert len(list(pipeline.feed(its.events()))) > 100
    assert pipelines[0].calibration != pipelines[1].calibration
    with pytest.raises(trihedron.InputRefused, match="is no covariance"):
        pipelines[0].push_fix(1e3, [0, 0, 0, 1], 0, np.diag([1, 1, -1]))


def refusal(path):
    with pytest.raises(trihedron.InputRefused) as caught:
        trihedron.read_pass(path)
    assert caught.value.cure
    return str(caught.value)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("H1[0]", "H1[3]", 'lacks column "H1[3]"'),
    ("h2_x", "h2_q", 'lacks column "h2_q"; did you mean'),
    ('"H1[0]"', '"H1"', 'column "H1" is of type fixed_size_list'),
    ('"h2_y"', '"h2_y.x"', 'lacks column "h2_y.x"'),
    ('scale = "UTC"', 'scale = "GPS"', 'column "stamp"'),  # the column says that it is UTC
    ('format = "iso"', 'format = "s"\nsince = "1970-01-01T00:00:00"\nleap_seconds = "left-out"', "is not a number"),
    ("gyro.parquet", "slews.parquet", "lacks column"),
    ("gyro.parquet", "parquet.toml", "lacks column"),
    ("gyro.parquet", "none.parquet", "none.parquet"),
    ("gyro.parquet", "broken.parquet", "is no Parquet file that pyarrow can read"),
])
def test_what_cannot_be_read_is_refused(directory, old, new, words):
    text = (directory / "parquet.toml").read_text()
    assert old in text
    (directory / "broken.parquet").write_bytes((directory / "gyro.parquet").read_bytes()[:-5000])
    (directory / "spoilt.toml").write_text(text.replace(old, new))
    assert words in refusal(directory / "spoilt.toml")


def test_damaged_files_are_read_or_refused(directory):
    whole = (directory / "slews.parquet").read_bytes()  # intervals are read before the tables
    toml = (directory / "csv.toml").read_text().replace("slews.csv", "damaged.parquet")  # the tables as CSV, which is soon read
    (directory / "damaged.toml").write_text(toml)
    refused = 0
    for seed in range(300):
        random = np.random.default_rng(seed)
        damaged = bytearray(whole if seed % 2 else whole[: random.integers(1, len(whole))])
        for _ in range(random.integers(1, 4)):
            damaged[random.integers(len(damaged))] = random.integers(256)
        (directory / "damaged.parquet").write_bytes(damaged)
        try:
            trihedron.read_pass(directory / "damaged.toml")
        except trihedron.InputRefused as error:
            assert "damaged.parquet" in str(error) and error.cure
            refused += 1
    assert refused > 200


def test_without_pyarrow_the_cure_is_to_install_it(directory, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    assert "pip install 'trihedron[parquet]'" in refusal(directory / "parquet.toml")


def test_the_program_says_how(directory):
    import os
    import subprocess
    done = subprocess.run([os.environ["TRIHEDRON_BUILD"] + "/trihedron", "inspect", directory / "parquet.toml"], capture_output=True, text=True)
    assert done.returncode == 3 and "to_netcdf('pass.nc')" in done.stderr
