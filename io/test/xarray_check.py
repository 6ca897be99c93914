"""What a user of xarray sees in a pass and in a residuals file written by io. Arguments: PASS.nc RESIDUALS.nc"""
import sys

import numpy as np
import xarray as xr

pass_file, residuals_file = sys.argv[1:]


def open_group(file, group=None):
    return xr.open_dataset(file, group=group, engine="h5netcdf")


root = open_group(pass_file)
assert root.attrs["Conventions"] == "CF-1.8", root.attrs
assert root.attrs["spacecraft"] == "TEST"
assert root.attrs["epoch_tai"] == "2009-05-20T00:00:00"
assert "[star_tracker]" in root.attrs["pass_toml"]

gyro = open_group(pass_file, "gyro")
assert dict(gyro.sizes) == {"time": 181}, gyro.sizes
assert "t_s" in gyro.coords
assert gyro.t_s.values[1] == np.datetime64("2009-05-20T00:00:00.500"), gyro.t_s.values[1]
assert gyro.t_s.attrs["standard_name"] == "time" and "TAI" in gyro.t_s.attrs["comment"]
assert gyro.h1_x.dtype == np.float64 and np.isnan(gyro.h1_x.values[0])
assert abs(gyro.h2_z.values[180] - np.sin(0.09)) < 2.6e-10
for name in ("h1_x", "h1_y", "h1_z", "h2_x", "h2_y", "h2_z"):
    assert gyro[name].attrs["units"] == "1" and "gyro" in gyro[name].attrs["long_name"]

fixes = open_group(pass_file, "star_tracker")
assert dict(fixes.sizes) == {"time": 31}
assert abs(fixes.q_w.values[30] - np.cos(0.045)) < 1e-15 and "quaternion" in fixes.q_w.attrs["long_name"]

truth = open_group(pass_file, "truth")
assert truth.h2_z.values[5] == 0.8 and "lambda_rad" in truth.attrs["truth_json"]

residuals = open_group(residuals_file, "fixes")
assert residuals.nis.values[0] == 4.5 and np.isnan(residuals.nis.values[1])
assert residuals.t_s.values[1] == np.datetime64("2009-05-20T00:00:03")
assert open_group(residuals_file, "empty").sizes["time"] == 0
