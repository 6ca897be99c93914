#!/usr/bin/env python3
"""Flies trihedron's filters and those of others over the same nine hours, one after another, and its batch and that with Ceres: peers.py BUILD OUT [PROGRAM=HOW…].

OUT is the JSON for performance.py. Each PROGRAM is another filter: it takes the pass and prints one or more lines as paper_model.hpp's
print() does; HOW says how it was built. The two in Python need numpy and filterpy (requirements.txt) and take half a minute each. Ceres is
flown where it was there when BUILD was configured. Ends with 1 where the results of two of the same model differ.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SCENARIO = '[scenario]\nseed = 3\n[gyro.drift]\noutside_sigma = "0rad/s"\n'
OURS = "trihedron, the filter of the paper"
OUR_BATCH = "trihedron, each fix by itself"
# Of a parameter, in its sigmas, and of a sigma, relative. A covariance that is kept in full loses half its digits: the alignments become known
# 1e4 times as well as before, and their variances 1e8 times. Of 16 digits 8 are left, with a factor of 100 for 270 000 steps.
LARGEST = (1e-6, 1e-6)
# Of a batch: iterations end where a step is about a hundredth of a sigma. The derivatives by hand are those of trihedron, which take the
# attitude that turns the drift for known; Jets do not. trihedron as it flies merges fixes closer than 15 s.
LARGEST_OF_BATCH = {"Ceres, derivatives by hand": (0.03, 1e-6), "Ceres, derivatives by Jets": (0.03, 1e-3), "trihedron, the batch": (0.05, 1e-3)}


def run(command, built=""):
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    found = [json.loads(line) for line in lines]
    for peer in found:
        if built:
            peer.setdefault("built", built)
        print(f"{peer['peer']:40} {peer['seconds'] * 1e3:10.1f} ms", flush=True)
    return found


def compare(peer, reference, largest):
    """Puts into it by how much it differs; whether that is too much."""
    sigmas = reference["sigmas"]
    peer["difference_sigmas"] = max(abs(a - b) / s for a, b, s in zip(peer["parameters"], reference["parameters"], sigmas, strict=True))
    peer["sigma_ratio"] = max(abs(a / b - 1) for a, b in zip(peer["sigmas"], sigmas, strict=True))
    wrong = not (peer["difference_sigmas"] <= largest[0] and peer["sigma_ratio"] <= largest[1])
    if wrong:
        print(f"{peer['peer']}: differs by {peer['difference_sigmas']:.1e} σ, its sigmas by {peer['sigma_ratio']:.1e}", file=sys.stderr)
    return wrong


def filters_differ(found):
    reference = next(peer for peer in found if peer["peer"] == OURS)
    return any([compare(peer, reference, LARGEST) for peer in found if not peer["peer"].startswith("trihedron")])


def batches_differ(found):
    references = {peer["walk_rad_sqrt_s"]: peer for peer in found if peer["peer"] == OUR_BATCH}
    return any([compare(peer, references[peer["walk_rad_sqrt_s"]], next(bounds for name, bounds in LARGEST_OF_BATCH.items() if peer["peer"].startswith(name)))
                for peer in found if peer["peer"] != OUR_BATCH])


def main():
    build, out, programs = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        scenario, flown = pathlib.Path(folder) / "scenario.toml", pathlib.Path(folder) / "pass"
        scenario.write_text(SCENARIO)
        subprocess.run([build / "trihedron", "--quiet", "simulate", scenario, "-o", flown], check=True)
        batches = run([build / "trihedron_peer_ours_batch", flown], "-O3, any x86-64")
        for suffix, built in (("", "-O3, any x86-64"), ("_native", "-O3 -march=native")):
            program = build / f"trihedron_peer_ceres_batch{suffix}"
            batches += run([program, flown], built) if program.exists() else []
        filters = run([build / "trihedron_peer_ours", flown], "-O3, any x86-64")
        filters += run([build / "trihedron_peer_dense", flown], "-O3, any x86-64")
        filters += run([build / "trihedron_peer_dense_native", flown], "-O3 -march=native")
        for program in programs:
            path, _, built = program.partition("=")
            filters += run([path, flown], built)
        for script, built in (("numpy_filter.py", "NumPy"), ("filterpy_filter.py", "filterpy")):
            filters += run([sys.executable, HERE / script, flown], built)
    wrong = any([filters_differ(filters), batches_differ(batches)])
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps({"filters": filters, "batches": batches}, indent=1) + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
