"""The demonstration, which is made once for all tests of it: cli.DemoBrowser opens the report that is here left in the build directory. Run by CTest
with TRIHEDRON_BUILD naming that."""
import shutil

import pytest

from program import BUILD, TRUSTWORTHY, run

DEMO = BUILD / "demo"


@pytest.mark.long
def test_demo_repeats_the_papers_experiment(tmp_path):
    shutil.rmtree(DEMO, ignore_errors=True)
    result = run("demo", "-o", DEMO)
    assert result.returncode == TRUSTWORTHY, result.stderr + result.stdout
    assert "gyro 1 D, degree 1" in result.stdout  # a drift that eq. (1) does not contain
    assert f"The report is {DEMO / 'report.html'}" in result.stdout
    assert sorted(f.name for f in DEMO.iterdir()) == [
        "attitude.csv", "calibration.json", "effective-config.toml", "navigation.csv", "pass.nc", "report.html", "residuals.nc",
        "scenario.toml"]
    again = run("--quiet", "simulate", DEMO / "scenario.toml", "-o", tmp_path / "again.nc")
    assert again.returncode == TRUSTWORTHY
    assert (tmp_path / "again.nc").read_bytes() == (DEMO / "pass.nc").read_bytes()
