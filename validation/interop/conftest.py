"""Files that the program writes for other software, and what is in them. TRIHEDRON_BUILD names the build directory."""
import json
import os
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("TRIHEDRON_BUILD", ROOT / "build")) / "trihedron"
EPOCH = "2008-12-31T23:58:00"  # TAI: a leap second of UTC lies within
COLUMNS = ("q_x", "q_y", "q_z", "q_w")
SCENARIO = '[scenario]\nseed = 7\nduration = "4min"\n[gyro]\nperiod = "1s"\n'
TOLD = """
drift_model = "esg7"
[filter]
noise = "told"
[further_states]
clock_offset = "off"
orbital_error = "off"
readout_bias = "off"
coefficient_change = "off"
wandering_drift = "off"
"""


def run(*arguments):
    result = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert result.returncode in (0, 1), result.stderr
    return result.stdout


def read_attitude(path):
    """t_s in whole nanoseconds, and q_in_c, scalar last."""
    lines = path.read_text().splitlines()
    assert lines[0].startswith("t_s,q_x,q_y,q_z,q_w")
    rows = [line.split(",") for line in lines[1:]]
    t_ns = []
    for row in rows:
        whole, _, fraction = row[0].partition(".")
        t_ns.append(int(whole) * 10**9 + int(fraction.ljust(9, "0")))
    return np.array(t_ns), np.array([[float(value) for value in row[1:5]] for row in rows])


class Attitude:
    """A body that turns fast and not evenly, every 125 ms, with three gaps; one stretch is a single epoch."""

    def __init__(self, path):
        generator = np.random.default_rng(1)
        t_ns = np.arange(0, 200 * 10**9, 125 * 10**6)
        gone = ((t_ns >= 30e9) & (t_ns < 33e9)) | ((t_ns >= 90e9) & (t_ns < 91e9)) | ((t_ns > 91e9) & (t_ns < 95e9))
        self.t_ns = t_ns[~gone]
        axes = np.array([0.3, -0.7, 0.5]) / np.sqrt(0.83)
        angle = 0.02 * self.t_ns * 1e-9 + 0.3 * np.sin(0.05 * self.t_ns * 1e-9)
        q = np.column_stack([np.sin(angle / 2)[:, None] * axes, np.cos(angle / 2)])
        q += 1e-4 * generator.standard_normal(q.shape)
        self.q = q / np.linalg.norm(q, axis=1)[:, None]
        self.path = path
        path.write_text("t_s,q_x,q_y,q_z,q_w\n" + "".join(
            f"{t // 10**9}.{t % 10**9:09d},{','.join(f'{value:.17g}' for value in row)}\n" for t, row in zip(self.t_ns, self.q)))
        steps = np.nonzero(np.diff(self.t_ns) > 187 * 10**6)[0]
        self.stretches = list(zip(self.t_ns[np.r_[0, steps + 1]], self.t_ns[np.r_[steps, len(self.t_ns) - 1]]))


@pytest.fixture(scope="session")
def attitude(tmp_path_factory):
    return Attitude(tmp_path_factory.mktemp("attitude") / "attitude.csv")


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory):
    """A directory with a pass, its calibration and its attitude."""
    directory = tmp_path_factory.mktemp("calibrated")
    (directory / "scenario.toml").write_text(SCENARIO)
    (directory / "told.toml").write_text(TOLD)
    run("--quiet", "simulate", directory / "scenario.toml", "-o", directory / "pass")
    run("--quiet", "calibrate", directory / "pass", "-o", directory / "out", "--config", directory / "told.toml")
    return directory


@pytest.fixture(scope="session")
def calibration(calibrated):
    return json.loads((calibrated / "out" / "calibration.json").read_text())
