#!/usr/bin/python3
"""Measures the verdict as a test is measured: verdict.py PROGRAM OUTCOMES [--document FILE] [--worlds PATTERN] [--estimators NAMES] [--seeds N] [--jobs N].

For each world and seed a pass of nine hours and the four and a half after it are simulated and, where the world says so, made wrong. Each estimator
calibrates the nine hours; `navigate` flies its result open loop through the rest. A result is wrong where the truth is beyond LIMIT_SIGMAS of
what it claims, or beyond the need, 5 arcmin for 270 min. The verdict is that of `calibrate`: exit status 0 is trustworthy.

Outcomes go into the file OUTCOMES, a line of JSON each, so that a run goes on where it was interrupted; they hold for the program they were found with.
--document writes the tables of docs/verdict.md of all outcomes there are.
"""
import argparse
import concurrent.futures
import hashlib
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

import passes
from rotations import exponential, inverse, logarithm, product
from worlds import ARCSECOND, PASS_S, WORLDS

FORECAST_S = 270 * 60.0
NEED_RAD = math.radians(5 / 60)
NEED = "5arcmin for 270min"
LIMIT_SIGMAS = 4
# The last is FORECAST_S.
FORECASTS_MIN = (90, 270)
# Of the epochs of an attitude history. By normal errors 4 sigmas of one of three axes are passed at 2 in 10 000; neighbours are alike.
ROWS_BEYOND = 0.01
ESTIMATORS = ("invariant", "batch")
# Memory instead of a disk: a pass of CSV files has 35 MB and lives for seconds.
SCRATCH = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


def key_of(world, seed):
    """Of the random generator of a world and of its scenario: the same on every machine."""
    return int.from_bytes(hashlib.sha256(f"{world} {seed}".encode()).digest()[:4], "big")


# ---- One pass

def call(program, *arguments):
    """The exit status and what was printed; 4, the machine failed, is no outcome."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in (0, 1, 3):
        raise RuntimeError(f"{' '.join(map(str, arguments))}: exit status {done.returncode}\n{done.stderr}")
    return done.returncode, done.stdout


def rows_of(file, columns, every_ms=3000):
    """{milliseconds: numbers} of the rows of a CSV file at multiples of every_ms."""
    with open(file) as text:
        head = next(text).rstrip("\n").split(",")
        place = [head.index(column) for column in columns]
        rows = {}
        for line in text:
            t = round(float(line[:line.index(",")]) * 1000)
            if t % every_ms == 0:
                cells = line.split(",")
                rows[t] = [float(cells[i]) for i in place]
        return rows


QUATERNION = ("q_x", "q_y", "q_z", "q_w")
SIGMAS = ("sigma_x_rad", "sigma_y_rad", "sigma_z_rad")


class Truth:
    def __init__(self, whole, moved):
        self.gyros = json.loads((whole / "truth.json").read_text())["gyros"]
        self.attitude = {t: tuple(q) for t, q in rows_of(whole / "truth.csv", QUATERNION).items()}
        self.alignments = [exponential(gyro["lambda_rad"]) for gyro in self.gyros]
        if moved and moved.exchanged:
            self.gyros.reverse()
            self.alignments.reverse()
        if moved and moved.gyro:
            self.alignments[0] = product(self.alignments[0], inverse(moved.gyro))
        if moved and moved.tracker:
            self.alignments = [product(inverse(moved.tracker), alignment) for alignment in self.alignments]
            self.attitude = {t: product(q, moved.tracker) if t > PASS_S * 1000 else q for t, q in self.attitude.items()}


def sigma_of(matrix, at):
    """0 where the covariance has no number, so that no error is within it."""
    return math.sqrt(matrix[at][at] or 0)


def worst_in_sigmas(errors):
    return max(abs(error) / sigma if sigma > 0 else math.inf for error, sigma in errors)


def alignment_errors(truth, calibration):
    """Of each axis of each gyro: (error, sigma), rad."""
    matrix, states = calibration["covariance"]["matrix"], calibration["covariance"]["states"]
    errors = []
    for number, (true, gyro) in enumerate(zip(truth.alignments, calibration["gyros"]), 1):
        off = logarithm(product(true, inverse(exponential(gyro["alignment_rotation_vector_rad"]))))
        for axis, error in zip("xyz", off):
            at = states.index(f"gyro{number}.align_{axis}")
            errors.append((error, sigma_of(matrix, at)))
    return errors


EQ1 = ("k0", "mu12", "mu23", "mu31", "nu12", "nu23", "nu31")


def drift_errors(truth, calibration):
    """Of each coefficient of eq. (1) of each gyro: (error, sigma), rad/s."""
    matrix, states = calibration["covariance"]["matrix"], calibration["covariance"]["states"]
    errors = []
    for number, (true, gyro) in enumerate(zip(truth.gyros, calibration["gyros"]), 1):
        for name, value in zip(EQ1, true["drift_rad_s"]):
            at = states.index(f"gyro{number}.{name}")
            errors.append((value - gyro["drift_rad_s"][name], sigma_of(matrix, at)))
    return errors


def nees_of(errors, calibration):
    """eᵀ P⁻¹ e of the coefficients of eq. (1) and the alignments, in the order of drift_errors() and alignment_errors(). In units of the sigmas,
    by Cholesky's decomposition; None where P is not positive definite."""
    matrix, states = calibration["covariance"]["matrix"], calibration["covariance"]["states"]
    numbers = range(1, len(calibration["gyros"]) + 1)
    at = [states.index(f"gyro{number}.{name}") for number in numbers for name in EQ1]
    at += [states.index(f"gyro{number}.align_{axis}") for number in numbers for axis in "xyz"]
    sigmas = [sigma for _, sigma in errors]
    if not all(sigmas):
        return None
    rows, white = [], []
    for i, (error, sigma) in enumerate(errors):
        row = []
        for j in range(i + 1):
            left = matrix[at[i]][at[j]] / sigmas[i] / sigmas[j] - math.fsum(a * b for a, b in zip(row, rows[j] if j < i else row))
            if i == j and left <= 0:
                return None
            row.append(math.sqrt(left) if i == j else left / rows[j][j])
        rows.append(row)
        white.append((error / sigma - math.fsum(a * b for a, b in zip(row, white))) / row[i])
    return math.fsum(value * value for value in white)


def errors_by_axis(truth, file):
    """At the epochs of both: {milliseconds: (errors about x, y and z; their sigmas)}, rad."""
    return {t: (logarithm(product(inverse(truth.attitude[t]), tuple(row[:4]))), row[4:])
            for t, row in rows_of(file, QUATERNION + SIGMAS).items() if t in truth.attitude}


def attitude_errors(errors):
    """Of each epoch of errors_by_axis(): (error, rad; error of the worst axis in its sigmas)."""
    for off, sigmas in errors.values():
        yield math.sqrt(sum(x * x for x in off)), max(abs(x) / sigma for x, sigma in zip(off, sigmas))


def forecast_at(errors, after_min):
    """Errors and sigmas by axis, arcseconds, at the last epoch of the minute before the forecast is so old; None where it has none."""
    end = round((PASS_S + 60 * after_min) * 1000)
    last = max((t for t in errors if end - 60_000 <= t <= end), default=None)
    return None if last is None else {name: [rounded(x / ARCSECOND) for x in values]
                                      for name, values in zip(("error_arcsec", "sigma_arcsec"), errors[last])}


def judged(program, directory, truth, estimator):
    """An outcome of one estimator on the passes of the directory."""
    out, forecast = directory / estimator, directory / f"{estimator}.csv"
    status, printed = call(program, "--json", "calibrate", directory / "pass", "-o", out, "--estimator", estimator, "--need", NEED)
    if status == 3:
        return {"status": status, "findings": ["refused"], "wrong": []}
    calibration = json.loads((out / "calibration.json").read_text())
    drift = drift_errors(truth, calibration)
    findings = {finding["code"]: finding.get("severity", "") for finding in calibration["verdict"]["findings"]}
    wrong = []

    alignment = alignment_errors(truth, calibration)
    alignment_sigmas = worst_in_sigmas(alignment)
    if not alignment_sigmas <= LIMIT_SIGMAS:
        wrong.append("alignment")

    history = list(attitude_errors(errors_by_axis(truth, out / "attitude.csv")))
    beyond = sum(not sigmas <= LIMIT_SIGMAS for _, sigmas in history) / len(history) if history else 0
    worst_rad = max((error for error, sigmas in history if not sigmas <= LIMIT_SIGMAS), default=0)
    if beyond > ROWS_BEYOND or worst_rad > NEED_RAD:
        wrong.append("attitude")

    # The fixes of the rest are there for the first one alone.
    flown, _ = call(program, "--json", "navigate", directory / "later", "--calibration", out / "calibration.json",
                    "--correction-interval", "none", "-o", forecast)
    by_axis = errors_by_axis(truth, forecast) if flown != 3 else {}
    ahead = list(attitude_errors(by_axis))
    forecast_rad = max((error for error, _ in ahead), default=math.inf)
    forecast_sigmas = max((sigmas for _, sigmas in ahead), default=math.inf)
    # Half of the epochs: what navigates falls away where the calibration is of another world.
    if not forecast_sigmas <= LIMIT_SIGMAS or len(ahead) < FORECAST_S / 3 / 2:
        wrong.append("forecast")
    if not forecast_rad <= NEED_RAD:
        wrong.append("need")
    return {"status": status, "findings": sorted(findings), "do_not_use": sorted(code for code, severity in findings.items() if severity == "do-not-use"),
            "wrong": wrong, "alignment_sigmas": rounded(alignment_sigmas),
            "alignment_arcsec": rounded(max(abs(error) for error, _ in alignment) / ARCSECOND),
            "drift_sigmas": rounded(worst_in_sigmas(drift)), "nees": rounded(nees_of(drift + alignment, calibration)),
            "nees_states": len(drift + alignment), "rows_beyond": rounded(beyond), "attitude_arcsec": rounded(worst_rad / ARCSECOND),
            "forecast_sigmas": rounded(forecast_sigmas), "forecast_arcsec": rounded(forecast_rad / ARCSECOND),
            "predicted_arcsec": rounded(predicted_rad(calibration) / ARCSECOND), "predicted_causes": predicted_causes(calibration),
            "wandering": [calibration.get("noise", {}).get(f"wandering_{what}") for what in ("drift_rad_s", "time_s")],
            "forecast_at": {str(after_min): forecast_at(by_axis, after_min) for after_min in FORECASTS_MIN}}


def predicted_rad(calibration):
    """That the error is said to stay below over the need, 99.7 %."""
    return calibration.get("forecast", {}).get("need", {}).get("error_997_rad", math.inf)


def predicted_causes(calibration):
    """{cause: its share of the mean square of the error that is predicted at the end of the need}; they overlap, the smallest are left out."""
    causes = calibration.get("forecast", {}).get("need", {}).get("causes", [])
    return {cause["name"]: rounded(cause["share"]) for cause in causes}


def rounded(value):
    return float(f"{value:.4g}") if value is not None and math.isfinite(value) else None


def outcomes_of(program, name, seed, estimators):
    """What these estimators make of the pass of the world of this name and seed."""
    world = next(world for world in WORLDS if world.name == name)
    key = key_of(world.name, seed)
    with tempfile.TemporaryDirectory(prefix="verdict-", dir=SCRATCH) as scratch:
        directory = pathlib.Path(scratch)
        (directory / "scenario.toml").write_text(
            f'[scenario]\nseed = {key}\nduration = "{(PASS_S + FORECAST_S) / 60:.0f}min"\n' + world.scenario(random.Random(key)))
        status, _ = call(program, "--quiet", "simulate", directory / "scenario.toml", "-o", directory / "whole")
        if status != 0:
            raise RuntimeError(f"{world.name}: the scenario was refused\n{(directory / 'scenario.toml').read_text()}")
        passes.cut(directory / "whole", directory / "pass", directory / "later", PASS_S)
        (directory / "whole" / "gyro.csv").unlink()
        moved = None
        if world.edit:
            moved = world.edit(passes.Telemetry(directory / "pass"), random.Random(key))
            world.edit(passes.Telemetry(directory / "later"), random.Random(key))
        truth = Truth(directory / "whole", moved)
        return [{"world": world.name, "seed": seed, "estimator": estimator} | judged(program, directory, truth, estimator) for estimator in estimators]


# ---- All of them

def digest(program):
    return hashlib.sha256(pathlib.Path(program).read_bytes()).hexdigest()[:16]


class Outcomes:
    """One line of JSON for each run, with the program that it holds for."""

    def __init__(self, file, program):
        self.file, self.program = file, digest(program)
        self.found = []
        if file.exists():
            for line in file.read_text().splitlines():
                try:
                    outcome = json.loads(line)
                except json.JSONDecodeError:  # the line that was being written when the run was killed
                    continue
                if outcome["program"] == self.program:
                    self.found.append(outcome)

    def has(self, world, seed, estimator):
        return any((outcome["world"], outcome["seed"], outcome["estimator"]) == (world.name, seed, estimator) for outcome in self.found)

    def add(self, outcomes):
        new = [{"program": self.program} | outcome for outcome in outcomes]
        self.found += new
        self.file.parent.mkdir(parents=True, exist_ok=True)
        # A line that was cut short by a kill is ended, so that it does not take the next one with it.
        cut_short = self.file.exists() and self.file.read_bytes()[-1:] not in (b"", b"\n")
        with open(self.file, "a") as file:
            file.write("\n" * cut_short + "".join(json.dumps(outcome) + "\n" for outcome in new))


def measure(program, outcomes, worlds, seeds, estimators, jobs):
    """Seed by seed, so that an interrupted run has some of every world. Returns why some have no outcome; they are tried again the next time."""
    failures = []
    every = [(world, seed, [e for e in estimators if not outcomes.has(world, seed, e)]) for seed in seeds for world in worlds]
    missing = [run for run in every if run[2]]
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        running = [pool.submit(outcomes_of, program, world.name, seed, names) for world, seed, names in missing]
        try:
            for done, future in enumerate(concurrent.futures.as_completed(running), 1):
                try:
                    found = future.result()
                except RuntimeError as failure:
                    failures.append(failure)
                    print(f"{done} of {len(missing)}: no outcome: {failure}", flush=True)
                    continue
                outcomes.add(found)
                print(f"{done} of {len(missing)}: " + "; ".join(line_of(outcome) for outcome in found), flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return failures


def line_of(outcome):
    if outcome["status"] == 3:
        return f"{outcome['world']} {outcome['seed']} {outcome['estimator']}: refused"
    said = {0: "trustworthy", 1: "do not use"}[outcome["status"]]
    return (f"{outcome['world']} {outcome['seed']} {outcome['estimator']}: {said}, "
            + (f"wrong ({', '.join(outcome['wrong'])})" if outcome["wrong"] else "right")
            + (f" {', '.join(outcome['do_not_use'])}" if outcome.get("do_not_use") else ""))


# ---- The tables

def bounds(hits, runs, confidence=0.95):
    """Clopper and Pearson's interval of a probability of which `hits` in `runs` were seen."""
    if runs == 0:
        return 0.0, 1.0

    def at_most(k, p):
        """P(X <= k), X binomial."""
        if p <= 0 or k >= runs:
            return 1.0
        if p >= 1:
            return 0.0
        return math.fsum(math.exp(math.lgamma(runs + 1) - math.lgamma(i + 1) - math.lgamma(runs - i + 1)
                                  + i * math.log(p) + (runs - i) * math.log1p(-p)) for i in range(k + 1))

    def solve(falls_below, level):
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if falls_below(middle) > level else (low, middle)
        return (low + high) / 2

    tail = (1 - confidence) / 2
    lower = 0.0 if hits == 0 else solve(lambda p: at_most(hits - 1, p), 1 - tail)
    upper = 1.0 if hits == runs else solve(lambda p: at_most(hits, p), tail)
    return lower, upper


def is_wrong(outcome):
    return bool(outcome["wrong"])


def is_trusted(outcome):
    return outcome["status"] == 0


def share(hits, runs):
    low, high = bounds(hits, runs)
    return f"{hits} of {runs}: {100 * hits / runs:.1f} % ({100 * low:.1f} … {100 * high:.1f})" if runs else "–"


def summary(outcomes):
    """Of results (a refusal is none): wrong ones called trustworthy, of all; right ones called not, of all right ones."""
    results = [outcome for outcome in outcomes if outcome["status"] != 3]
    right = [outcome for outcome in results if not is_wrong(outcome)]
    return (sum(is_wrong(outcome) and is_trusted(outcome) for outcome in outcomes), len(outcomes),
            sum(not is_trusted(outcome) for outcome in right), len(right))


NEED_NOT_MET = "need-not-met"
WITH_CONSTANT_DRIFT = ("in the models", "drift outside eq. (1)", "dirty telemetry")
FAULTS = {world.name: set(world.faults) for world in WORLDS}


def reasons(outcomes):
    """Of right results that are called not: for a fault that their world does have; for the need alone; for what is not there."""
    counts = [0, 0, 0]
    for outcome in outcomes:
        if outcome["status"] == 1 and not is_wrong(outcome):
            codes = set(outcome.get("do_not_use", []))
            counts[0 if codes & FAULTS[outcome["world"]] else 1 if codes == {NEED_NOT_MET} else 2] += 1
    return counts


def median(values):
    ordered = sorted(values)
    middle = len(ordered) // 2
    return ordered[middle] if len(ordered) % 2 else (ordered[middle - 1] + ordered[middle]) / 2


def predictions(outcomes):
    """Of needs not met: the largest error of the forecast over the error that is predicted to be kept in 99.7 % of the cases. Of those
    that are met the single fix at which the forecast begins would be seen instead."""
    rows = []
    for estimator in ESTIMATORS:
        ratios = [o["forecast_arcsec"] / o["predicted_arcsec"] for o in outcomes
                  if o["estimator"] == estimator and NEED_NOT_MET in o["findings"] and "forecast" not in o["wrong"]
                  and o.get("forecast_arcsec") and o.get("predicted_arcsec")]
        if ratios:
            rows.append([estimator, str(len(ratios)), f"{median(ratios):.2f}", f"{max(ratios):.2f}", str(sum(ratio < 0.1 for ratio in ratios))])
    return table(["estimator", "forecasts of needs not met", "median", "largest", "below 0.1"], rows)


def forecast_ratios(outcomes, world, estimator, after_min):
    """Errors of forecasts over their sigmas, as `navigate` claims them, of all passes and axes."""
    its = [o["forecast_at"] for o in outcomes if o["world"] == world.name and o["estimator"] == estimator and o.get("forecast_at")]
    return [error / sigma for ages in its if ages[str(after_min)] for error, sigma in zip(*ages[str(after_min)].values())]


def root_mean_square(values):
    return math.sqrt(math.fsum(value * value for value in values) / len(values))


def with_right_widths(outcomes):
    """Of right results, how many are told that their need is not met, and how many would be if each prediction were made as wide as the errors
    of its world and estimator turn out to be."""
    rows = []
    for estimator in ESTIMATORS:
        right, told, would_be = 0, 0, 0
        for world in WORLDS:
            its = [o for o in outcomes if (o["world"], o["estimator"]) == (world.name, estimator) and o["status"] != 3 and not is_wrong(o)]
            ratios = forecast_ratios(outcomes, world, estimator, FORECASTS_MIN[-1])
            factor = root_mean_square(ratios) if ratios else 1
            right += len(its)
            told += sum(NEED_NOT_MET in o["findings"] for o in its)
            would_be += sum(factor * (o.get("predicted_arcsec") or math.inf) * ARCSECOND > NEED_RAD for o in its)
        if right:
            rows.append([estimator, str(right), str(told), str(would_be)])
    return table(["estimator", "right results", "told that the need is not met", "with the widths that are right in each world"], rows)


def widths(outcomes):
    """Root mean square over passes and axes of the errors of forecasts in their sigmas: 1 where these are right."""
    rows = []
    for world in WORLDS:
        cells = []
        for estimator in ESTIMATORS:
            for after_min in FORECASTS_MIN:
                ratios = forecast_ratios(outcomes, world, estimator, after_min)
                cells += [f"{root_mean_square(ratios):.2f}", f"{max(map(abs, ratios)):.1f}"] if ratios else ["·", "·"]
        if any(cell != "·" for cell in cells):
            rows.append([world.name, *cells])
    return table(["world"] + [head for estimator in ESTIMATORS for after_min in FORECASTS_MIN
                              for head in (f"{estimator}, {after_min} min", "largest")], rows)


def table(heads, rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in [heads, ["---"] * len(heads), *rows])


def in_all(outcomes):
    groups = list(dict.fromkeys(world.group for world in WORLDS))
    of_group = {group: [world.name for world in WORLDS if world.group == group] for group in groups}
    rows = []
    for name, chosen in [(group, lambda o, group=group: o["world"] in of_group[group]) for group in groups] + [("all", lambda o: True)]:
        for estimator in ESTIMATORS:
            trusted_wrong, runs, refused_right, right = summary([o for o in outcomes if chosen(o) and o["estimator"] == estimator])
            rows.append([name, estimator, share(trusted_wrong, runs), share(refused_right, right),
                         ", ".join(map(str, reasons([o for o in outcomes if chosen(o) and o["estimator"] == estimator]))) if refused_right else "·"])
    return table(["worlds", "estimator", "wrong, called trustworthy, of all", "right, called not, of the right ones",
                  "for a fault that is there, the need alone, nothing"], rows)


def per_world(outcomes):
    rows = []
    for world in WORLDS:
        for estimator in ESTIMATORS:
            its = [o for o in outcomes if o["world"] == world.name and o["estimator"] == estimator]
            if not its:
                continue
            counts = [sum(is_wrong(o) == wrong and o["status"] != 3 and is_trusted(o) == trusted for o in its)
                      for wrong, trusted in ((False, True), (False, False), (True, False), (True, True))]
            refused = sum(o["status"] == 3 for o in its)
            why = sorted({code for o in its for code in o.get("do_not_use", [])})
            what = sorted({reason for o in its if is_trusted(o) for reason in o["wrong"]})
            off = [o for o in its if (sigmas := o.get("drift_sigmas", 0)) is None or sigmas > LIMIT_SIGMAS]
            told = sum(not is_trusted(o) or "drift-not-explained" in o["findings"] for o in off)
            rows.append([world.name, estimator, *(str(count) if count else "·" for count in (*counts, refused)),
                         f"{len(off)}, {told}" if off else "·", ", ".join(what), ", ".join(why)])
    return table(["world", "estimator", "right, trusted", "right, not", "wrong, not", "**wrong, trusted**", "refused", "coefficient off, told", "wrong and trusted in", "findings that forbid use"], rows)


def consistency(outcomes):
    """NEES over the number of states; of worlds that no findings describe, whose coefficients are constant."""
    rows = []
    for world in WORLDS:
        its = {estimator: [o["nees"] / o["nees_states"] for o in outcomes
                           if o["world"] == world.name and o["estimator"] == estimator and o.get("nees") is not None] for estimator in ESTIMATORS}
        if world.group in WITH_CONSTANT_DRIFT and not world.faults and any(its.values()):
            rows.append([world.name] + [cell for estimator in ESTIMATORS for cell in (
                (str(len(its[estimator])), f"{math.fsum(its[estimator]) / len(its[estimator]):.2f}", f"{max(its[estimator]):.2f}")
                if its[estimator] else ("·", "·", "·"))])
    return table(["world"] + [head for estimator in ESTIMATORS for head in (f"{estimator}: passes", "mean", "largest")], rows)


def write(document, outcomes):
    """Each table stands between `<!-- NAME -->` and `<!-- end -->`; the text around it is left alone."""
    text = document.read_text()
    for name, made in (("in-all", in_all(outcomes)), ("predictions", predictions(outcomes)), ("right-widths", with_right_widths(outcomes)), ("widths", widths(outcomes)), ("per-world", per_world(outcomes)),
                       ("consistency", consistency(outcomes))):
        text, places = re.subn(rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda place: place[1] + made + "\n" + place[2], text, flags=re.DOTALL)
        if places != 1:
            sys.exit(f"{document}: has no place for the table {name}")
    document.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("outcomes", type=pathlib.Path)
    parser.add_argument("--document", type=pathlib.Path)
    parser.add_argument("--worlds", default="", metavar="PATTERN", help="regular expression that their names contain")
    parser.add_argument("--estimators", default=",".join(ESTIMATORS), metavar="NAMES", help="separated by commas; [default: %(default)s]")
    parser.add_argument("--seeds", type=int, default=12, metavar="N")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), metavar="N")
    given = parser.parse_args()
    program = given.program.resolve()
    outcomes = Outcomes(given.outcomes, program)
    worlds = [world for world in WORLDS if re.search(given.worlds, world.name)]
    failures = measure(program, outcomes, worlds, range(1, given.seeds + 1), given.estimators.split(","), given.jobs)
    print(per_world(outcomes.found))
    print(in_all(outcomes.found))
    print(consistency(outcomes.found))
    if given.document:
        write(given.document, outcomes.found)
    if failures:
        sys.exit(f"{len(failures)} runs have no outcome")


if __name__ == "__main__":
    main()
