#!/usr/bin/python3
"""Measures what docs/validation.md tells, and writes its tables: validate.py PROGRAM DOCUMENT [--campaign OUT] [--filters OUT].

Each table stands between `<!-- NAME -->` and `<!-- end -->`; the text around it is left alone. With --campaign or --filters that of this campaign alone,
whose runs are in OUT; those that are missing there are performed first.
"""
import argparse
import functools
import json
import math
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

import numpy
import xarray

ARCSECOND = math.pi / 180 / 3600
SEEDS = range(11, 21)


class Bench:
    """Runs the program in a directory of its own."""

    def __init__(self, program, directory):
        self.program, self.directory = program, directory

    def run(self, *arguments):
        result = subprocess.run([self.program, *map(str, arguments)], cwd=self.directory, capture_output=True, text=True)
        if result.returncode > 1:
            raise RuntimeError(result.stderr)
        return result.stdout

    def simulated(self, scenario):
        (self.directory / "scenario.toml").write_text(scenario)
        self.run("--quiet", "simulate", "scenario.toml", "-o", "pass.nc")

    def calibrated(self, scenario, estimator):
        """A pass by this scenario, calibrated: what `calibrate --json` prints, and errors and sigmas of the alignments, rad."""
        self.simulated(scenario)
        outcome = json.loads(self.run("--json", "calibrate", "pass.nc", "-o", "out", "--estimator", estimator))
        with xarray.open_dataset(self.directory / "pass.nc", group="truth", decode_times=False) as data:
            truth = json.loads(data.attrs["truth_json"])
        outcome["alignment_error_rad"] = []
        for true, found in zip(truth["gyros"], outcome["calibration"]["gyros"]):
            off = rotation(true["lambda_rad"]) @ rotation(found["alignment_rotation_vector_rad"]).T
            outcome["alignment_error_rad"] += list(rotation_vector(off))
        covariance = outcome["calibration"]["covariance"]
        outcome["alignment_sigma_rad"] = [math.sqrt(covariance["matrix"][i][i]) for i, name in enumerate(covariance["states"])
                                          if ".align_" in name]
        return outcome


def rotation(vector):
    """exp([v×])"""
    x, y, z = vector
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.sqrt(x * x + y * y + z * z)
    return numpy.eye(3) + numpy.sinc(angle / math.pi) * cross + 0.5 * numpy.sinc(angle / 2 / math.pi) ** 2 * cross @ cross


def rotation_vector(matrix):
    """Of a small rotation."""
    return numpy.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / 2


def table(heads, rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in [heads, ["---"] * len(heads), *rows])


def minutes_of(values):
    """Median of settling times where None is never."""
    known = [v / 60 for v in values if v is not None]
    if len(known) * 2 <= len(values):
        return f"not by the end in {len(values) - len(known)} of {len(values)}"
    padded = sorted(known) + [math.inf] * (len(values) - len(known))
    late = len(values) - len(known)
    return f"{padded[(len(padded) - 1) // 2]:.0f} min" + (f"; not by the end in {late} of {len(values)}" if late else "")


def angle(rad):
    return f"{rad / ARCSECOND:.1f}″" if rad < 60 * ARCSECOND else f"{rad / ARCSECOND / 60:.0f}′"


def span(values):
    low, high = min(values), max(values)
    return f"{angle(low)} … {angle(high)}"


def extension_of(runs):
    factors = sorted((run["extension"]["factor"], run["extension"]["is_lower_bound"]) for run in runs)
    middle = (len(factors) - 1) // 2
    bound = any(lower for _, lower in factors[: middle + 1])
    return f"{'≥ ' if bound else ''}{factors[middle][0]:.0f}"


def known_interval(runs, which):
    """Minutes until 5′, median over all corrections of all runs, those of the first correction apart."""
    values = []
    for run in runs:
        for correction in run["extension"]["corrections"][1:]:
            interval = correction[which]
            if interval["observed_s"] > 0:
                values.append((interval["passed_limit_after_s"] or interval["observed_s"], interval["passed_limit_after_s"] is None))
    values.sort()
    middle = (len(values) - 1) // 2
    bound = any(lower for _, lower in values[: middle + 1])
    return f"{'> ' if bound else ''}{values[middle][0] / 60:.1f} min"


def per_stretch(run):
    return [stretch["max_total_rad"] for stretch in run["navigation"]["per_90_min"] if stretch["epochs"] > 1]


def scenario_of(seed, outside, extra=""):
    return f'[scenario]\nseed = {seed}\n[gyro]\n{extra}[gyro.drift]\noutside_sigma = "{outside}rad/s"\n'


def claims(bench, estimator):
    kinds = {"0": [], "1e-8": [], "1e-7": []}
    for outside, runs in kinds.items():
        for seed in SEEDS:
            runs.append(bench.calibrated(scenario_of(seed, outside), estimator))
    columns = list(kinds.values())
    rows = [
        ["alignment settled", "one orbit, about 90 min"] + [minutes_of([r["convergence"]["alignment_s"] for r in c]) for c in columns],
        ["drift coefficients settled", "200–300 min"] + [minutes_of([r["convergence"]["drift_s"] for r in c]) for c in columns],
        ["largest error, first 90 min", "15′ in roll and heading"] + [span([per_stretch(r)[0] for r in c]) for c in columns],
        ["… second 90 min", "falling"] + [span([per_stretch(r)[1] for r in c]) for c in columns],
        ["… last 90 min", "falling"] + [span([per_stretch(r)[-1] for r in c]) for c in columns],
        ["open loop within 5′, known before", ""] + [known_interval(c, "known_before") for c in columns],
        ["open loop within 5′, calibrated", ""] + [known_interval(c, "calibrated") for c in columns],
        ["correction interval extended", "3–5 times"] + [extension_of(c) + " times" for c in columns],
        ["alignment error, rms of all axes", ""] + [
            angle(math.sqrt(statistics.mean(e * e for r in c for e in r["alignment_error_rad"]))) for c in columns],
        ["mean NIS, 4 expected", ""] + [f"{statistics.mean(r['calibration']['statistics']['nis_mean'] for r in c):.2f}" for c in columns],
    ]
    return table(["", "the paper", "all drift in eq. (1)", "1e-8 rad/s outside", "1e-7 rad/s outside"], rows)


def seeds(bench):
    rows = []
    for seed in SEEDS:
        run = bench.calibrated(scenario_of(seed, "0"), "invariant")
        pitch = [run["alignment_error_rad"][i] for i in (1, 4)]
        sigma = [run["alignment_sigma_rad"][i] for i in (1, 4)]
        rest = [abs(run["alignment_error_rad"][i]) for i in (0, 2, 3, 5)]
        rows.append([
            str(seed),
            " ".join(f"{v / ARCSECOND:+.2f}″" for v in pitch),
            " ".join(f"{v / ARCSECOND:.2f}″" for v in sigma),
            f"{max(rest) / ARCSECOND:.2f}″",
            f"{run['calibration']['statistics']['nis_mean']:.3f}",
            " ".join(angle(v) for v in per_stretch(run)),
        ])
    return table(["seed", "pitch alignment error, gyro 1, 2", "claimed 1σ", "other axes, largest", "NIS",
                  "largest open-loop error per 90 min"], rows)


def one_degree(bench):
    rows = []
    for seed in (1, 2, 3):
        run = bench.calibrated(scenario_of(seed, "0", 'misalignment_magnitude = "1deg"\nalignment_prior_sigma = "1deg"\n'), "paper")
        worst = max(abs(v) for v in run["alignment_error_rad"])
        restarts = run["fixes"].get("used, filter restarted", 0)
        rows.append([str(seed), f"{worst / ARCSECOND:.2f}″", f"{run['calibration']['statistics']['nis_mean']:.3f}", str(restarts)])
    return table(["seed", "alignment error, worst axis", "NIS", "begun anew"], rows)


def steady(bench):
    rows = []
    for seed in (1, 2, 3, 4):
        run = bench.calibrated(f'[scenario]\nseed = {seed}\n[attitude]\nslews = "none"\njitter = "0arcsec"\n[gyro.drift]\noutside_sigma = "0rad/s"\n', "paper")
        codes = [finding["code"] for finding in run["calibration"]["verdict"]["findings"]]
        rows.append([str(seed), f"{run['alignment_error_rad'][1] / ARCSECOND:+.0f}″", f"{run['alignment_sigma_rad'][1] / ARCSECOND:.0f}″",
                     "yes" if run["calibration"]["verdict"]["trustworthy"] else "no: " + ", ".join(codes)])
    return table(["seed", "pitch alignment error, gyro 1", "claimed 1σ", "trustworthy"], rows)


def measured(value, unit):
    if value is None:
        return "never"
    return angle_of_two(value) if unit == "rad" else f"{value / 60:.0f} min" if unit == "s" else f"{value:.1f}"


def angle_of_two(rad):
    return f"{rad / ARCSECOND:.2f}″" if rad < 10 * ARCSECOND else angle(rad)


def campaign(bench, file, out):
    arguments = ["--json", "campaign", file, "-o", out] + (["--resume"] if (out / "runs.journal").exists() else [])
    told = json.loads(bench.run(*arguments))
    rows = []
    for key, what in MEASURES.items():
        measure = told["measures"][key]
        if not measure["quantiles"]:  # a campaign of filters alone does not have it
            continue
        bound = measure["quantiles"][-1]["lower" if key in ("interval_after", "extension") else "upper"]
        rows.append([what, *(measured(one["value"], measure["unit"]) for one in measure["quantiles"]),
                     measured(bound, measure["unit"]) if bound is not None else "too few runs"])
    consistency = [f"{name} {its['mean']:.{digits}f} of {its['degrees_of_freedom']:.{digits}f} ({its['usual_low']:.{digits}f} … {its['usual_high']:.{digits}f} in 95 % "
                   f"of consistent campaigns)" for name, its, digits in (("NEES", told["nees"], 2), ("NIS", told["nis"], 4))]
    counts = told["outcomes"]
    findings = ", ".join(finding["code"] for finding in told["findings"]) or "none"
    return (f"{told['runs']} runs: {counts['trustworthy']} trustworthy, {counts['do_not_use']} do not use, {counts['failed']} failed. {'; '.join(consistency)}. "
            f"Findings of the campaign: {findings}.\n\n" + table(["", "50 %", "90 %", "95 %", "99.7 %", "99.7 %, with 90 % confidence"], rows))


HERE = pathlib.Path(__file__).resolve().parent
MEASURES = {"alignment_error": "alignment error, worst gyro", "attitude_rms": "attitude of the calibration, rms",
            "navigation_error": "navigator, corrected every 90 min, largest error", "open_loop_error": "open loop of 90 min, largest error",
            "open_loop_error_to_end": "open loop to the end of the pass, largest error", "drift_settled": "drift coefficients settled",
            "alignment_settled": "alignments settled", "extension": "correction interval extended, at least"}
TABLES = {"paper-claims": functools.partial(claims, estimator="invariant"),
          "paper-claims-by-its-filter": functools.partial(claims, estimator="paper"), 
          "seeds": seeds, "one-degree": one_degree, "steady": steady}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("document", type=pathlib.Path)
    campaigns = ("campaign", "filters")
    for name in campaigns:
        parser.add_argument(f"--{name}", metavar="OUT", type=pathlib.Path)
    given = parser.parse_args()
    outs = {name: vars(given)[name] for name in campaigns if vars(given)[name]}
    tables = {name: functools.partial(campaign, file=HERE / f"{name}.toml", out=out.resolve()) for name, out in outs.items()} or TABLES
    text = given.document.read_text()
    with tempfile.TemporaryDirectory() as directory:
        bench = Bench(given.program.resolve(), pathlib.Path(directory))
        for name, measure in tables.items():
            pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
            if not pattern.search(text):
                sys.exit(f"{given.document}: has no place for the table {name}")
            found = measure(bench)
            text = pattern.sub(lambda place: place[1] + found + "\n" + place[2], text)
            print(f"{name}\n{found}\n", flush=True)
    given.document.write_text(text)


if __name__ == "__main__":
    main()
