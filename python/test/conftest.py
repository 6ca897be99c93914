"""A short pass by the program, as a NetCDF file and as a directory, and what the program makes of it."""
import os
import pathlib
import subprocess

import pytest

import trihedron

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENARIO = ROOT / "python" / "test" / "scenario.toml"

# What each telemetry.toml of the tests begins with; keys of [star_tracker] may follow.
MAP_HEAD = """
[pass]
spacecraft = "TEST"
[gyro]
readout_noise_rad = 9.7e-6
drift_prior_sigma_rad_s = 2e-6
alignment_prior_sigma_rad = 8.73e-3
[star_tracker]
"""


def program(*arguments, status=(0, 1)):
    """Runs the program; 1 is its verdict that a short pass is not to be used."""
    path = pathlib.Path(os.environ["TRIHEDRON_BUILD"]) / "trihedron"
    done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode in status, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def work(tmp_path_factory):
    return tmp_path_factory.mktemp("python")


@pytest.fixture(scope="session")
def pass_nc(work):
    program("simulate", SCENARIO, "-o", work / "pass.nc")
    return work / "pass.nc"


@pytest.fixture(scope="session")
def pass_directory(work):
    program("simulate", SCENARIO, "-o", work / "pass")
    return work / "pass"


@pytest.fixture(scope="session")
def flown(pass_nc):
    return trihedron.read_pass(pass_nc)


@pytest.fixture(scope="session")
def calibrated(flown):
    return trihedron.calibrate(flown)
