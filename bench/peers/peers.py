#!/usr/bin/env python3
"""Flies trihedron's filters and those of others over the same nine hours, one after another: peers.py BUILD OUT [PROGRAM=HOW…].

OUT is the JSON for performance.py. Each PROGRAM is another filter: it takes the pass and prints one or more lines as paper_model.hpp's
print() does; HOW says how it was built. The two in Python need numpy and filterpy (requirements.txt) and take half a minute each. Ends with 1 where the results of
two filters of the same model differ.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SCENARIO = '[scenario]\nseed = 3\n[gyro.drift]\noutside_sigma = "0rad/s"\n'
OURS = "trihedron, the filter of the paper"
# Of a parameter, in its sigmas, and of a sigma, relative. A covariance that is kept in full loses half its digits: the alignments become known
# 1e4 times as well as before, and their variances 1e8 times. Of 16 digits 8 are left, with a factor of 100 for 270 000 steps.
LARGEST_DIFFERENCE_SIGMAS = 1e-6
LARGEST_RATIO = 1e-6


def run(command, built=""):
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    found = [json.loads(line) for line in lines]
    for peer in found:
        if built:
            peer.setdefault("built", built)
        print(f"{peer['peer']:40} {peer['seconds'] * 1e3:10.1f} ms", flush=True)
    return found


def main():
    build, out, programs = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        scenario, flown = pathlib.Path(folder) / "scenario.toml", pathlib.Path(folder) / "pass"
        scenario.write_text(SCENARIO)
        subprocess.run([build / "trihedron", "--quiet", "simulate", scenario, "-o", flown], check=True)
        found = run([build / "trihedron_peer_ours", flown], "-O3, any x86-64")
        found += run([build / "trihedron_peer_dense", flown], "-O3, any x86-64")
        found += run([build / "trihedron_peer_dense_native", flown], "-O3 -march=native")
        for program in programs:
            path, _, built = program.partition("=")
            found += run([path, flown], built)
        for script, built in (("numpy_filter.py", "NumPy"), ("filterpy_filter.py", "filterpy")):
            found += run([sys.executable, HERE / script, flown], built)
    reference = next(peer for peer in found if peer["peer"] == OURS)
    wrong = False
    for peer in found:
        if peer is reference or peer["peer"].startswith("trihedron"):
            continue
        sigmas = reference["sigmas"]
        peer["difference_sigmas"] = max(abs(a - b) / s for a, b, s in zip(peer["parameters"], reference["parameters"], sigmas))
        peer["sigma_ratio"] = max(abs(a / b - 1) for a, b in zip(peer["sigmas"], sigmas))
        if not (peer["difference_sigmas"] <= LARGEST_DIFFERENCE_SIGMAS and peer["sigma_ratio"] <= LARGEST_RATIO):
            print(f"{peer['peer']}: differs by {peer['difference_sigmas']:.1e} σ, its sigmas by {peer['sigma_ratio']:.1e}", file=sys.stderr)
            wrong = True
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(found, indent=1) + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
