"""A telemetry.toml whose tables are NetCDF is the pass that the program makes of them."""
import numpy as np
import pytest
import xarray as xr

import trihedron
from conftest import MAP_HEAD, program
from same_as_program_test import same_telemetry
from trihedron._netcdf import netcdf_as_csv

MAP = MAP_HEAD + """noise_rad = [1.5e-5, 1.5e-5, 9.7e-5]
[telemetry.time]
scale = "GPS"
format = "ms"
since = "1980-01-06T00:00:00"
[telemetry.gyro]
file = "acs.nc"
time_column = "gyros/stamp"
[[telemetry.gyro.unit]]
direction = ["gyros/h1[0]", "gyros/h1[1]", "gyros/h1[2]"]
flag = "gyros/good"
good = [1]
[[telemetry.gyro.unit]]
direction = ["gyros/h2_x", "gyros/h2_y", "-gyros/h2_z"]
[telemetry.star_tracker]
file = "acs.nc"
time_column = "stamp"
quaternion = ["q[0]", "q[1]", "q[2]", "q[3]"]
scalar = "last"
maps = "tracker-to-inertial"
[[telemetry.exclude]]
file = "slews.cdf"
begin_column = "begin"
end_column = "end"
"""


@pytest.fixture(scope="module")
def directory(flown, tmp_path_factory):
    """Stamps in whole milliseconds of GPS; one direction packed, with a fill value; fixes in the root group. Ten minutes are
    enough to be read in each way."""
    path = tmp_path_factory.mktemp("netcdf")
    gyro, fixes = (its.isel(time=its.t_s.values < 600) for its in (flown.gyro, flown.star_tracker))
    first = int((flown.epoch - np.datetime64("1980-01-06T00:00:19")) / np.timedelta64(1, "ms"))
    stamps = [first + np.round(its.t_s.values * 1e3).astype("int64") for its in (gyro, fixes)]
    h1 = np.stack([gyro[f"h1_{axis}"].values for axis in "xyz"], axis=1)
    packed = np.round(gyro.h2_x.values / 1e-9).astype("int32")
    packed[11] = -1
    tables = {
        "/": xr.Dataset({"stamp": ("fix", stamps[1]), "q": (("fix", "four"), np.stack([fixes[f"q_{c}"].values for c in "xyzw"], axis=1)),
                         "text": ("fix", np.full(len(stamps[1]), "x"))}),
        "gyros": xr.Dataset({"stamp": ("row", stamps[0]), "h1": (("row", "three"), h1), "good": ("row", (np.arange(len(h1)) % 50 != 3).astype("int8")),
                             "h2_x": ("row", packed, {"scale_factor": 1e-9, "add_offset": 0.0, "_FillValue": np.int32(-1)}),
                             "h2_y": ("row", gyro.h2_y.values), "h2_z": ("row", -gyro.h2_z.values)}),
    }
    xr.DataTree.from_dict(tables).to_netcdf(path / "acs.nc", engine="h5netcdf")
    xr.Dataset({"begin": ("slew", stamps[0][100:101]), "end": ("slew", stamps[0][180:181])}).to_netcdf(path / "slews.cdf", engine="h5netcdf")
    (path / "telemetry.toml").write_text(MAP)
    return path


def test_is_what_the_program_makes_of_the_same_file(directory):
    program("import", directory / "telemetry.toml", "-o", directory / "pass.nc")
    read = trihedron.read_pass(directory / "telemetry.toml")
    same_telemetry(read, trihedron.read_pass(directory / "pass.nc"))
    kinds = [its.kind for its in read.defects]
    assert "flagged" in kinds and "excluded" in kinds and "missing-value" in kinds


def refusal(path):
    with pytest.raises(trihedron.InputRefused) as caught:
        trihedron.read_pass(path)
    assert caught.value.cure
    return str(caught.value)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("gyros/h2_x", "gyros/h2_q", 'lacks column "gyros/h2_q"; did you mean'),
    ("gyros/h1[0]", "gyros/h1[3]", "it has 3 of them, counted from 0"),
    ("gyros/h1[0]", "gyros/h1[-1]", "has no such column"),
    ('"gyros/h1[0]"', '"gyros/h1"', "has 2 dimensions, not 1"),
    ('"q[3]"', '"text"', "does not hold numbers"),
    ('"q[3]"', '"gyros/h2_x"', "must have the same length"),
    ('format = "ms"\nsince = "1980-01-06T00:00:00"', 'format = "iso"', "where stamps are numbers"),
    ("acs.nc", "none.nc", "none.nc"),
])
def test_what_cannot_be_read_is_refused_as_by_the_program(directory, old, new, words):
    assert old in MAP
    (directory / "spoilt.toml").write_text(MAP.replace(old, new))
    said = refusal(directory / "spoilt.toml")
    assert words in said
    if "lacks" not in words:  # the program says so of a variable
        assert words.split(";")[0] in program_refuses(directory / "spoilt.toml")


def program_refuses(path):
    import os
    import subprocess
    done = subprocess.run([os.environ["TRIHEDRON_BUILD"] + "/trihedron", "inspect", path], capture_output=True, text=True)
    assert done.returncode == 3
    return done.stderr


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # h5netcdf closes what it could not open
def test_damaged_files_are_read_or_refused(directory):
    whole = (directory / "slews.cdf").read_bytes()  # intervals are read before the tables
    # The tables are not damaged. As CSV they are soon read where the damage to the intervals does no harm.
    damaged_map = MAP.replace("slews.cdf", "damaged.nc")
    for table, columns in (("gyro", ["gyros/stamp", "gyros/good", *(f"gyros/h1[{i}]" for i in range(3)), *(f"gyros/h2_{axis}" for axis in "xyz")]),
                           ("star_tracker", ["stamp", *(f"q[{i}]" for i in range(4))])):
        (directory / f"{table}.csv").write_text(netcdf_as_csv(str(directory / "acs.nc"), columns))
        damaged_map = damaged_map.replace("acs.nc", f"{table}.csv", 1)
    (directory / "damaged.toml").write_text(damaged_map)
    refused = 0
    for seed in range(100):
        random = np.random.default_rng(seed)
        damaged = bytearray(whole if seed % 2 else whole[: random.integers(1, len(whole))])
        for _ in range(random.integers(1, 4)):
            damaged[random.integers(len(damaged))] = random.integers(256)
        (directory / "damaged.nc").write_bytes(damaged)
        try:
            trihedron.read_pass(directory / "damaged.toml")
        except trihedron.InputRefused as error:
            assert "damaged" in str(error) and error.cure
            refused += 1
    assert refused > 50
