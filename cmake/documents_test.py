"""What the documents say of the sources is there.

Run by CTest: python3 -m pytest documents_test.py.
"""
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCUMENTS = ["docs/mathematics.md", "docs/architecture.md", "docs/reliability.md", "CONTRIBUTING.md"]
FOLDERS = ["core", "records", "sim", "io", "ground", "plan", "campaign", "report", "cli", "flight", "python", "bench", "validation", "fuzz", "examples", "docs",
           "cmake", "debian", "packaging", ".ci"]


def paths_named(text):
    """What stands in backticks and begins with a folder of the repository, but for patterns such as `src/<name>.cpp`."""
    quoted = re.findall(r"`([^`\s]+)`", text)
    return [path for path in quoted if path.split("/")[0] in FOLDERS and "/" in path and not re.search(r"[<>*{}…]", path)]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_paths_that_a_document_names_exist(document):
    paths = paths_named((ROOT / document).read_text())
    assert len(paths) > 5
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_paths_are_found_in_text():
    text = "See `core/include/a.hpp` (`docs/adr/`), `io/src/<format>.cpp`, `h_b`, `C_in_c`, `a/b`, and `cmake --preset x`."
    assert paths_named(text) == ["core/include/a.hpp", "docs/adr/"]


def test_each_class_and_function_of_the_libraries_has_a_comment(tmp_path):
    result = subprocess.run([ROOT / "docs" / "reference.sh", tmp_path], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
    assert (tmp_path / "cpp" / "index.html").exists()


def test_tables_of_the_application_are_up_to_date(tmp_path):
    subprocess.run([sys.executable, ROOT / "core" / "interface" / "tables.py", tmp_path], check=True)
    made = sorted(path.relative_to(tmp_path) for path in tmp_path.glob("**/*") if path.is_file())
    assert len(made) == 4
    assert [str(path) for path in made if (tmp_path / path).read_text() != (ROOT / path).read_text()] == []


@pytest.mark.parametrize("row, source, pattern", [
    ("`pass.toml`", "io/src/toml_table.hpp", r"kTomlVersion = (\d+)"),
    ("`truth.json`", "io/src/truth.cpp", r"kTruthVersion = (\d+)"),
    ("`calibration.json`", "io/src/calibration.cpp", r"kVersion = (\d+)"),
    ("catalogue", "io/src/catalogue.cpp", r"kSchemaVersion = (\d+)"),
    ("`residuals.nc`", "io/src/residuals.cpp", r'"version", "(\d+)"'),
    ("`runs.nc`", "io/src/run_table.cpp", r'"version", "(\d+)"'),
    ("journal", "io/src/campaign_journal.cpp", r'"version", (\d+)\}'),
    ("state of a replay", "core/include/trihedron/core/application.hpp", r"kStateVersion = (\d+)"),
    ("parameters", "core/interface/tables.toml", r"^version = (\d+)"),
    ("interface in C", "core/include/trihedron.h", r"TRIHEDRON_INTERFACE_VERSION (\d+)u"),
])
def test_page_of_formats_tells_the_versions_of_the_sources(row, source, pattern):
    told = re.findall(rf"^\| {re.escape(row)}[^|]*\| (\d+) \|", (ROOT / "docs/formats.md").read_text(), re.M)
    assert told == re.findall(pattern, (ROOT / source).read_text(), re.M)
