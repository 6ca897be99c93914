"""Types: the package and its users are checked by mypy, with the stub that was made of the module."""
import os
import pathlib
import subprocess
import sys
import textwrap

import pytest

import trihedron


def mypy(*arguments, directory):
    environment = dict(os.environ)
    package = pathlib.Path(trihedron.__file__).parent
    if "site-packages" not in package.parts:  # that of the build directory
        environment["MYPYPATH"] = str(package.parent)
    return subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", str(directory / "mypy"), *map(str, arguments)],
                          cwd=directory, env=environment, capture_output=True, text=True)


USER = """
    import numpy as np
    import trihedron

    p = trihedron.read_pass("pass.nc")
    r = trihedron.calibrate(p, estimator="batch", filter={"gate_nis": 40}, progress=print)
    good: bool = r.verdict.trustworthy
    name: str = r.states[0]
    trace: np.float64 = r.covariance.trace()
    cures: list[str] = [finding.cure for finding in r.findings]
    for report in trihedron.Pipeline(p.settings).feed(p.events()):
        text: str = report.fix
"""


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    directory = tmp_path_factory.mktemp("mypy")
    # What shows notebooks is there for other tests, and matplotlib names it: none of its types is one of ours, and it is a third of what mypy would read.
    (directory / "mypy.ini").write_text("[mypy]\n[mypy-IPython.*]\nfollow_imports = skip\n")
    (directory / "good.py").write_text(textwrap.dedent(USER))
    (directory / "bad.py").write_text(textwrap.dedent(USER + """
    trihedron.calibrate(p, estimater="batch")
    trihedron.calibrate("pass.nc")
    wrong: int = r.states[0]
    r.verdict.trustworthy = True
"""))
    return directory


def test_the_package_and_a_user_are_clean(checked):
    done = mypy("--strict", "-p", "trihedron", directory=checked)
    assert done.returncode == 0, done.stdout
    done = mypy("--strict", "good.py", directory=checked)
    assert done.returncode == 0, done.stdout


def test_wrong_uses_are_found(checked):
    done = mypy("--strict", "bad.py", directory=checked)
    found = [line.split(": error: ")[1] for line in done.stdout.splitlines() if ": error: " in line]
    assert len(found) == 4, done.stdout
    assert "estimater" in found[0] and '"str"' in found[1] and '"int"' in found[2] and "read-only" in found[3]
