"""One cell of the campaigns of docs/consistency.md, flown and tabulated as `make consistency` does it. Run by CTest with TRIHEDRON_BUILD naming the
build directory."""
import os
import pathlib
import re
import subprocess

import pytest

BUILD = pathlib.Path(os.environ["TRIHEDRON_BUILD"])
CAMPAIGNS = pathlib.Path(__file__).resolve().parent.parent / "consistency"

pytestmark = pytest.mark.long


def of_one_cell(name):
    """The campaign with one value of each grid of the scenario, two flights, of three hours: so long that all is determined, and a third of the work."""
    text = re.sub(r"repeats = \d+", "repeats = 2", (CAMPAIGNS / name).read_text())
    text = text.replace("[base.gyro.drift]", '[base.scenario]\nduration = "3h"\n\n[base.gyro.drift]')
    kept = {"attitude": '{grid = [{}], names = ["slews"]}', "gyro.drift.prior_sigma": '{grid = ["1e-6rad/s"]}',
            "gyro.misalignment_magnitude": '{grid = ["30arcmin"]}', "gyro.drift.direction_walk": '{grid = ["0rad/s^0.5"]}'}
    for key, grid in kept.items():
        text, count = re.subn(rf"^{re.escape(key)} = .*$", f"{key} = {grid}", text, flags=re.MULTILINE)
        assert count == 1, key
    text = text.replace('"../told.toml"', f'"{CAMPAIGNS.parent / "told.toml"}"')
    return re.sub(r"\n  \[\[?\{start_direction_c = \[0\.(995.*0\.05|7).*", "", text).replace(', "plane-plane", "oblique"]', "]")


@pytest.fixture(scope="module", params=["filters.toml", "whole-pass.toml"])
def flown(request, tmp_path_factory):
    directory = tmp_path_factory.mktemp("consistency")
    (directory / request.param).write_text(of_one_cell(request.param))
    done = subprocess.run([BUILD / "trihedron", "--quiet", "campaign", directory / request.param, "-o", directory / "out"], capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return directory, directory / request.param


def tabulated(flown, *arguments):
    directory, campaign = flown
    return subprocess.run([BUILD / "trihedron_consistency", campaign, directory / "out", *arguments], capture_output=True, text=True)


def test_the_filter_is_consistent_in_one_cell(flown):
    table = tabulated(flown).stdout
    assert "NEES, invariant: outside its band in 0 of 1 rows up to 1°, in 0 of 0 beyond." in table
    row = next(line for line in table.splitlines() if line.startswith("| slews | plane-normal | 1e-06rad/s | 30arcmin | 0rad/s^0.5 |"))
    estimators = re.findall(r"NEES, (\w+) \|", table)
    ratio = float(row.split("|")[6 + 3 * estimators.index("invariant") + 2])
    assert 0.4 < ratio < 2  # about 1; the 40 errors go together, and are worth ten or so that do not


def test_covariances_give_the_other_tables(flown):
    if flown[1].name != "whole-pass.toml":
        return
    assert re.search(r"outside its band in 0 of 1 rows", tabulated(flown, "--table", "observable").stdout)
    assert "by parameter 0, by combination 0 of 1 rows" in tabulated(flown, "--table", "agreement").stdout


def test_the_table_is_put_into_its_place(flown, tmp_path):
    document = tmp_path / "page.md"
    document.write_text("Before\n<!-- here -->\nold\n<!-- end -->\nAfter\n")
    assert tabulated(flown, document, "--place", "here", "--runs", "1").returncode == 0
    page = document.read_text()
    assert page.startswith("Before\n<!-- here -->\n") and page.endswith("<!-- end -->\nAfter\n") and "1 runs per row" in page and "old" not in page
    nowhere = tabulated(flown, document, "--place", "there")
    assert nowhere.returncode == 1 and "no place" in nowhere.stderr


def test_other_campaigns_and_cells_are_refused(flown, tmp_path):
    directory, campaign = flown
    assert "no cell" in tabulated(flown, "--cells", "^none").stderr
    other = tmp_path / "other.toml"
    other.write_text(campaign.read_text().replace("30arcmin", "60arcmin"))
    refused = tabulated((directory, other))
    assert refused.returncode == 1 and "of another campaign" in refused.stderr and "60arcmin" in refused.stderr
