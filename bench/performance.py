#!/usr/bin/env python3
"""Measures what docs/performance.md tells and writes its tables: performance.py BUILD DOCUMENT [--kept DIRECTORY].

Times are Google Benchmark's, of the processor; instructions are callgrind's, and exact. Both are kept as JSON in DIRECTORY (out/bench);
what is there and newer than the programs is not measured again, so that an interrupted run goes on. What bench/peers/peers.py
has left there of the filters and batches of others is put in as well.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

SAMPLES = 9 * 3600 * 8 + 1
FIX_PERIOD_S = 3
FIXES = 9 * 3600 // FIX_PERIOD_S + 1
HOLD_S = 30


# ---- The floor: what the method itself has to do, in operations (additions, multiplications, divisions and roots of doubles) and bytes

def prediction_operations():
    """Of one gyro over one sample, with eq. (1): each line a product or sum that the method has."""
    basis = 3 + 5 + 3 * 2 + 9  # squares, their sum, the column of k0, the other twelve entries less their signs
    to_inertial = 45 + 9  # C_in_c C_c_b, times the step
    turn = 3 * 13  # the columns times κ, then turned
    momentum = 5 + 9 + 9 + 12 + 9  # its rotation, and to unit length
    sums = 3 + 3 * (9 + 3) + 15 + 3 * 9 + 3 * 3 + 7 * 3  # of the turn; turn × C_in_c; C_in_b B, whose columns have few entries
    return basis + to_inertial + turn + momentum + sums


def attitude_operations():
    """Of a pair by a sample."""
    readings = 2 * 15
    axes = 2 * (9 + 5 + 4 + 3 + 5 + 4 + 9)
    return readings + axes + 45


def fix_operations(n=26, d=6, m=4, parameters=10):
    """Of the square root of the covariance, n states of which d move, m components."""
    def seen(states):
        """A row with entries for these states, times the root."""
        return sum(2 * (n - state) for state in states)
    gyros = d // 3
    drift = [range(d + k * parameters, d + (k + 1) * parameters) for k in range(gyros)]
    alignments = [state for its in drift for state in its[-3:]]
    propagate = sum(3 * seen([*range(3 * k, 3 * k + 3), *drift[k]]) for k in range(gyros))
    noise = sum(4 * (d + 1) * (d - j) for j in range(d))
    directions_and_alignments = [*range(d), *alignments]
    innovation = m * seen(directions_and_alignments) + m * (m + 1) * n
    attitude = 3 * seen(directions_and_alignments) + 12 * n
    update = (4 * m + 1) * n * (n + 1) // 2 + n * (6 * m + 4 * m * (m - 1) // 2) + 2 * m * n
    # The four terms of second order of each gyro, which hold for 30 s where they are small (docs/mathematics.md, section 8).
    second_order = sum(3 * seen(its) + 12 * n for k in range(gyros) for its in
                       (alignments[3 * k:3 * k + 3], drift[k][:-3], alignments[3 * k:3 * k + 3], [*range(3 * k, 3 * k + 3), *alignments[3 * k:3 * k + 3]]))
    return propagate + noise + innovation + attitude + update + second_order // (HOLD_S // FIX_PERIOD_S)


FILE_BYTES = SAMPLES * (8 + 6 * 8) + FIXES * (8 + 4 * 8)  # of the pass as doubles
RESULT_NUMBERS = FIXES * (8 + 14 + 8)  # attitude as text, residuals, figures of the report

FLOOR = {
    "read NetCDF": (FILE_BYTES, "byte of the pass in memory"),
    "read CSV": (FILE_BYTES, "byte of the pass in memory"),
    "intake": (SAMPLES * 2 * (6 + 5), "operation"),
    "prediction": (SAMPLES * (2 * prediction_operations() + attitude_operations()), "operation"),
    "fixes": (FIXES * fix_operations(), "operation"),
    "filter": (SAMPLES * (2 * prediction_operations() + attitude_operations()) + FIXES * fix_operations(), "operation"),
}
WHY = {
    "read NetCDF": "inflating the chunks, then one pass that scales the packed integers and one that screens",
    "read CSV": "1.6 characters a byte, each looked at once, and decimal numbers to the nearest double",
    "intake": "branches: finite, unit, not stuck, the clock; an operation is the smaller part of a check",
    "prediction": "both gyros in an instruction, but loads and stores of a state in memory; the time is that of a chain: each step needs the attitude "
                  "that the last one gives",
    "fixes": "the root is a third of it, four doubles an instruction where there is AVX2; the rest are products of 3 × 3, which are scalar "
             "(`EIGEN_DONT_VECTORIZE`: the same bits everywhere), checks and reports, none of which the floor counts",
    "filter": "as prediction and fixes",
}


SIDE_BY_SIDE = "eight of them side by side"
TOGETHER = 8

# Under callgrind each of these takes a quarter of an hour: `calibrate` is decisions and what is told, and of the batch the time says enough.
NOT_COUNTED = {"calibrate", "batch, all told", "batch, all told, definitive attitude", "batch"}


# ---- Measuring

def kept(path, newer_than, measure):
    """What is in the file, measured where it is missing or older than the program."""
    if not path.exists() or path.stat().st_mtime < newer_than.stat().st_mtime:
        path.write_text(json.dumps(measure(), indent=1) + "\n")
    return json.loads(path.read_text())


def times_of(program, directory):
    def measure():
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "bench.json"
            subprocess.run([program, f"--benchmark_out={out}", "--benchmark_out_format=json"], check=True)
            return json.loads(out.read_text())
    return kept(directory / "times.json", program, measure)


def instructions(command):
    """Between the marks; of the whole program where it has none."""
    with tempfile.TemporaryDirectory() as folder:
        marked = pathlib.Path(command[0]).name == "trihedron_count_parts"
        subprocess.run(["valgrind", "--tool=callgrind", *(["--instr-atstart=no"] if marked else []), f"--callgrind-out-file={folder}/out", *command],
                       check=True, capture_output=True)
        totals = {}
        for file in pathlib.Path(folder).iterdir():
            text = file.read_text()
            part = re.search(r"^desc: Trigger: Client Request: part$", text, re.MULTILINE)
            totals[bool(part)] = int(re.search(r"^(?:totals|summary): (\d+)", text, re.MULTILINE).group(1))
        return totals[marked]


def counts_of(program, directory, names):
    counts = {}
    for name in names:
        path = directory / ("count-" + re.sub(r"[^a-z0-9]+", "-", name.lower()) + ".json")
        counts[name] = kept(path, program, lambda: {"instructions": instructions([program, name])})["instructions"]
        print(f"{name:40} {counts[name] / 1e6:12.1f} million instructions", flush=True)
    return counts


# ---- Tables

def table(header, rows, right=1):
    lines = ["| " + " | ".join(header) + " |", "|" + "|".join("---" if i < right else "---:" for i in range(len(header))) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def milliseconds(its, which="cpu_time"):
    """Of the processor, or by the clock ("real_time"). Google Benchmark's own figure is in the unit of the benchmark."""
    return its[which] * {"ns": 1e-6, "us": 1e-3, "ms": 1, "s": 1e3}[its["time_unit"]]


def parts_table(names, times, counts):
    rows = []
    for name in names:
        its, count = milliseconds(times[f"nine hours/{name}"]), counts.get(name)
        samples = SAMPLES * (TOGETHER if name == SIDE_BY_SIDE else 1)
        rows.append([name, f"{its:.0f}", f"{samples / its / 1e3:.2f}", *([f"{count / 1e6:.0f}", f"{count / samples:.0f}"] if count else ["", ""])])
    return table(["part", "ms", "million samples/s", "million instructions", "instructions a sample"], rows)


def goals_table(times):
    def of(*names):
        return [sum(milliseconds(times[f"nine hours/{name}"], which) for name in names) for which in ("cpu_time", "real_time")]
    files = ("read NetCDF", "report", "write results")
    goals = [("nine hours through the default filter: 26 states, a fix each 3 s, a prediction at each sample", 40, of("filter")),
             ("`calibrate` from NetCDF to written results, decisions included", 250, of("calibrate", *files)),
             ("the same by estimator batch", 500, of("batch", *files)),
             ("a flight simulated, filtered and compared, of eight side by side: 40 a second on two cores", 50, [its / TOGETHER for its in of(SIDE_BY_SIDE)])]
    return table(["", "goal, ms", "now, ms", "by the clock, ms", ""],
                 [[what, f"{goal}", f"{now:.0f}", f"{elapsed:.0f}", "met" if now <= goal else f"{now / goal:.1f} times the goal"]
                  for what, goal, (now, elapsed) in goals])


def floor_table(counts):
    rows = []
    for name, (floor, unit) in FLOOR.items():
        if name in counts:
            rows.append([name, f"{floor / 1e6:.0f} million", unit, f"{counts[name] / floor:.1f}", WHY[name]])
    return table(["part", "floor", "of", "instructions for each", "why"], rows)


def scaling_table(times, counts):
    rows = []
    for name, its in times.items():
        kind = name.split("/")[0]
        if kind in ("hours", "states", "gyros"):
            count = counts.get("/".join(name.split("/")[:2]))
            what = {"hours": "hours of a pair", "states": "drift model, one hour", "gyros": "gyros with eq. (1), one hour"}[kind]
            rows.append([f"{what}: {name.split('/')[1]}", f"{its['states']:.0f}" if "states" in its else "26", f"{milliseconds(its):.1f}",
                         f"{1e3 / its['items_per_second'] * 1e3:.2f}", f"{count / 1e6:.1f}" if count else ""])
    return table(["", "states", "ms", "µs a sample", "million instructions"], rows)


def agreement_of(peer):
    return "" if "difference_sigmas" not in peer else f"{peer['difference_sigmas']:.0e} σ, sigmas to {peer['sigma_ratio']:.0e}"


def filters_table(found):
    ours = next(peer for peer in found if peer["peer"] == "trihedron, the filter of the paper")
    rows = [[peer["peer"], peer.get("built", ""), f"{peer['seconds'] * 1e3:.0f}", f"{peer['seconds'] / ours['seconds']:.1f}", agreement_of(peer)] for peer in found]
    return table(["filter", "built", "ms", "times ours", "greatest difference of a parameter"], rows, right=2)


def batches_table(found):
    """trihedron's sigmas are part of its solution."""
    rows = []
    for ours in (peer for peer in found if peer["peer"] == "trihedron, the batch"):
        walk = ours["walk_rad_sqrt_s"]
        for peer in (peer for peer in found if peer["walk_rad_sqrt_s"] == walk):
            whole = peer["seconds"] + peer.get("sigmas_seconds", 0)
            rows.append([peer["peer"], f"walk of {walk:.0e} rad/√s" if walk else "none", peer["built"], f"{peer['seconds'] * 1e3:.0f}", f"{peer['seconds'] / ours['seconds']:.1f}",
                         f"{whole * 1e3:.0f}", f"{whole / ours['seconds']:.1f}", agreement_of(peer)])
    return table(["batch", "process noise", "built", "ms", "times ours", "ms with sigmas", "times ours", "greatest difference of a parameter"], rows, right=3)


def place_of(table_name):
    return re.compile(rf"(<!-- {table_name} -->\n).*?(<!-- end -->)", re.DOTALL)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("document", type=pathlib.Path)
    parser.add_argument("--kept", type=pathlib.Path, default=pathlib.Path("out/bench"))
    arguments = parser.parse_args()
    if missing := [name for name in ("parts", "goals", "floor", "scaling", "peers", "batches") if not place_of(name).search(arguments.document.read_text())]:
        sys.exit(f"{arguments.document}: has no place for {', '.join(missing)}")
    build, directory = arguments.build.resolve(), arguments.kept
    directory.mkdir(parents=True, exist_ok=True)
    counter = build / "trihedron_count_parts"
    listed = subprocess.run([counter], capture_output=True, text=True, check=False).stderr
    names = [line.strip() for line in listed.splitlines() if line.startswith("  ")]
    counts = counts_of(counter, directory, [name for name in names if name not in NOT_COUNTED] + ["hours/1", "hours/3", "hours/9"])
    times = {re.sub(r"/process_time$", "", its["name"]): its for its in times_of(build / "trihedron_bench", directory)["benchmarks"]}
    tables = {"parts": parts_table(names, times, counts), "goals": goals_table(times), "floor": floor_table(counts), "scaling": scaling_table(times, counts)}
    peers = directory / "peers.json"
    if peers.exists():
        found = json.loads(peers.read_text())
        tables |= {"peers": filters_table(found["filters"]), "batches": batches_table(found["batches"])}
    text = arguments.document.read_text()
    for name, measured in tables.items():
        text = place_of(name).sub(lambda place: place[1] + measured + "\n" + place[2], text)
        print(f"\n{name}\n{measured}")
    arguments.document.write_text(text)


if __name__ == "__main__":
    main()
