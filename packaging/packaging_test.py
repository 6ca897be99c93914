"""What is installed, from the build directory into a prefix; versions that must agree.

Run by CTest with TRIHEDRON_BUILD naming the build directory. What is made of it for others is tried by make deb-test, image-test, conan-test.
"""
import os
import pathlib
import re
import subprocess
import tomllib

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(os.environ["TRIHEDRON_BUILD"])
VERSION = re.search(r"^project\(trihedron VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("prefix")
    subprocess.run(["cmake", "--install", BUILD, "--component", "program", "--prefix", prefix], check=True, capture_output=True)
    return prefix


def test_installed_are_program_manual_pages_and_completion(prefix):
    told = subprocess.run([prefix / "bin/trihedron", "man", "--markdown"], capture_output=True, text=True).stdout
    commands = set(re.findall(r"^## (\w+)$", told, re.M))
    assert {"calibrate", "navigate"} < commands
    assert sorted(str(path.relative_to(prefix)) for path in prefix.rglob("*") if path.is_file()) == [
        "bin/trihedron", "share/bash-completion/completions/trihedron", "share/fish/vendor_completions.d/trihedron.fish",
        *(f"share/man/man1/trihedron-{command}.1" for command in sorted(commands)), "share/man/man1/trihedron.1",
        "share/zsh/site-functions/_trihedron"]


def test_installed_program_tells_the_version_of_the_project(prefix):
    assert subprocess.run([prefix / "bin/trihedron", "--version"], capture_output=True, text=True).stdout == VERSION + "\n"
    assert VERSION in (prefix / "share/man/man1/trihedron.1").read_text().splitlines()[0]


def test_what_needs_mpi_is_installed_apart(prefix, tmp_path):
    if not (BUILD / "trihedron-mpi.so").exists():
        pytest.skip("built without MPI: cmake/setup.sh mpi installs it")
    subprocess.run(["cmake", "--install", BUILD, "--component", "mpi", "--prefix", tmp_path], check=True, capture_output=True)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["trihedron-mpi.so"]
    for program, needs in ((prefix / "bin/trihedron", False), (next(tmp_path.rglob("trihedron-mpi.so")), True)):
        assert ("libmpi" in subprocess.run(["readelf", "-d", program], check=True, capture_output=True, text=True).stdout) is needs


@pytest.mark.long
def test_installed_program_simulates_and_calibrates(prefix, tmp_path):
    """Away from the sources and the build directory."""
    (tmp_path / "scenario.toml").write_text('[scenario]\nseed = 1\nduration = "30min"\n')
    for arguments in (["simulate", "scenario.toml", "-o", "pass.nc"], ["inspect", "pass.nc"]):
        subprocess.run([prefix / "bin/trihedron", *arguments], cwd=tmp_path, check=True, capture_output=True)
    calibrated = subprocess.run([prefix / "bin/trihedron", "calibrate", "pass.nc", "-o", "out"], cwd=tmp_path, capture_output=True, text=True)
    assert calibrated.returncode in (0, 1), calibrated.stderr  # half an hour need not be enough
    assert "Plotly" in (tmp_path / "out/report.html").read_text()


def test_version_stands_in_one_place():
    """The program, the library, the Conan recipe and the Python package take it from CMakeLists.txt; a changelog of Debian has to repeat it."""
    assert re.match(r"trihedron \(([^)]+)\)", (ROOT / "debian/changelog").read_text())[1] == VERSION
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["scikit-build"]["metadata"]["version"]
    assert re.search(wheel["regex"], (ROOT / wheel["input"]).read_text())["value"] == VERSION


def test_build_dependencies_of_the_debian_package_are_those_that_setup_installs():
    declared = re.search(r"^Build-Depends:(.*?)^\S", (ROOT / "debian/control").read_text(), re.M | re.S)[1]
    declared = {re.sub(r"\(.*?\)", "", package).strip() for package in declared.split(",")} - {"debhelper-compat"}
    groups = dict(re.findall(r"^(program|mpi)=\((.*?)\)$", (ROOT / "cmake/setup.sh").read_text(), re.M | re.S))
    installed = set(groups["program"].split() + groups["mpi"].split())
    assert declared == installed - {"clang-16", "ca-certificates", "openmpi-bin"}  # compiled by g++, which build-essential has; mpirun is for those who run it
