"""The program under test and what its tests have in common. TRIHEDRON_BUILD names the build directory."""
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TRIHEDRON_BUILD", ROOT / "build"))
PROGRAM = BUILD / "trihedron"
TRUSTWORTHY, DO_NOT_USE, WRONG_USAGE, INPUT_REFUSED, MACHINE_FAILED = range(5)

# Settings with nothing left to decide, which takes runs of its own.
TOLD = """
drift_model = "esg7"
[filter]
noise = "told"
[further_states]
clock_offset = "off"
clock_rate = "off"
orbital_error = "off"
readout_bias = "off"
coefficient_change = "off"
wandering_drift = "off"
"""


def run(*arguments, **options):
    words = [word if isinstance(word, bytes) else str(word) for word in arguments]
    return subprocess.run([PROGRAM, *words], capture_output=True, check=False, **{"text": True, **options})


def refused(result, status, *words):
    """By this status, in one line on stderr that holds the words; nothing on stdout."""
    assert result.returncode == status, (result.returncode, result.stderr)
    assert not result.stdout, result.stdout
    assert result.stderr.startswith("trihedron: ") and result.stderr.count("\n") == 1, result.stderr
    for word in words:
        assert str(word) in result.stderr, result.stderr
