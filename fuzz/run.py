#!/usr/bin/env python3
"""Runs every fuzz target for a time, and prints what came of it: inputs tried, crashes, hangs, worst time, worst memory.

    fuzz/run.py BUILD [--seconds 3600 | --briefly] [--jobs 2] [--targets csv,netcdf] [--corpus DIRECTORY] [--document docs/reliability.md]

Begins with the seeds that BUILD/trihedron_fuzz_seeds writes, the inputs of fuzz/corpus, and what earlier runs have left in the corpus.
A target goes on after a crash until it has had its time: of a processor, or --briefly by the clock, beside other work. libFuzzer tells a hang by the
clock, which other work on the machine sets forward: each is tried again alone, and counts where it takes as long of a processor. Exit status 1 where
anything was found; the inputs that did it are in the corpus' directory `found`, and are tried again by: BUILD/fuzz_TARGET FILE.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import resource
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
LIMIT_S = 10
LIMIT_MB = 1024  # resident, with all that the sanitizers add
LONGEST = {"netcdf": 200_000, "catalogue": 100_000, "calibration": 40_000, "truth": 40_000, "csv": 20_000, "scenario": 20_000}  # bytes
# What every user gives the program; the others are of formats of exchange, or other ways into these.
EVERYDAY = ("calibration", "catalogue", "csv", "netcdf", "pass_toml", "scenario", "settings")
SANITIZERS = {"ASAN_OPTIONS": "allocator_may_return_null=0:detect_stack_use_after_return=0", "UBSAN_OPTIONS": "print_stacktrace=1"}


def targets(build):
    return sorted(path.name.removeprefix("fuzz_") for path in build.glob("fuzz_*") if os.access(path, os.X_OK) and path.is_file())


def figure(name, text):
    found = re.findall(rf"stat::{name}: +([\d.]+)", text)
    return float(found[-1]) if found else 0.0


def hangs(build, target, file):
    """Whether one input takes LIMIT_S of a processor, or never ends."""
    try:
        return subprocess.run([build / f"fuzz_{target}", file], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, **SANITIZERS},
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S)), timeout=60 * LIMIT_S).returncode != 0
    except subprocess.TimeoutExpired:
        return True


def fuzz(build, target, corpus, seconds, by_clock):
    """One row of the table. `seconds`: of a processor, or by the clock."""
    own, found = corpus / target, corpus / "found"
    for directory in (own, found):
        directory.mkdir(parents=True, exist_ok=True)
    before = {path.name for path in found.iterdir()}
    seeds = [path for path in (corpus / "seeds" / target, ROOT / "fuzz" / "corpus" / target) if path.exists()]
    row = {"target": target, "inputs": 0, "seconds": 0.0, "worst_ms": 0.0, "worst_mb": 0.0}
    began = time.monotonic()
    while (left := seconds - (time.monotonic() - began if by_clock else row["seconds"])) >= 1:
        command = [build / f"fuzz_{target}", own, *seeds, f"-max_total_time={int(left)}", f"-timeout={LIMIT_S}", f"-rss_limit_mb={LIMIT_MB}",
                   f"-max_len={LONGEST.get(target, 4096)}", f"-artifact_prefix={found}/{target}-", "-print_final_stats=1", "-verbosity=1",
                   "-close_fd_mask=1", "-use_value_profile=1", "-reload=0"]  # no other process adds to the corpus
        log = corpus / f"{target}.log"
        with log.open("wb") as stderr:
            running = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=stderr, env={**os.environ, **SANITIZERS})
            usage = os.wait4(running.pid, 0)[2]
        said = log.read_text(errors="replace")
        row["seconds"] += usage.ru_utime + usage.ru_stime
        row["inputs"] += int(figure("number_of_executed_units", said))
        row["worst_ms"] = max(row["worst_ms"], figure("worst_time_ms", said), 1000 * figure("slowest_unit_time_sec", said))
        row["worst_mb"] = max(row["worst_mb"], figure("peak_rss_mb", said))
    for path in (*found.glob(f"{target}-timeout*"), *found.glob(f"{target}-slow*")):
        if path.name not in before and not hangs(build, target, path):
            path.unlink()
    new = [path.name for path in found.iterdir() if path.name.startswith(target + "-") and path.name not in before]
    row["crashes"] = sum(name.startswith((f"{target}-crash", f"{target}-leak")) for name in new)
    row["hangs"] = sum(name.startswith((f"{target}-timeout", f"{target}-slow")) for name in new)
    row["out_of_memory"] = sum(name.startswith(f"{target}-oom") for name in new)
    print(f"{target}: {row['inputs']} inputs in {row['seconds']:.0f} s, found {new or 'nothing'}", flush=True)
    return row


HEADING = ["| target | processor time, s | inputs tried | crashes | hangs | out of memory | worst time, ms | worst memory, MB |",
           "|---|---:|---:|---:|---:|---:|---:|---:|"]


def line(row):
    return (f"| {row['target']} | {row['seconds']:.0f} | {row['inputs']:,} | {row['crashes']} | {row['hangs']} | "
            f"{row['out_of_memory']} | {row['worst_ms']:.0f} | {row['worst_mb']:.0f} |".replace(",", " "))


def cells(text):
    return [cell.strip() for cell in text.strip().strip("|").split("|")]


def with_earlier(row, text):
    """Time and inputs are those of all runs, and so are the worst; what was found, of this one."""
    earlier = [float(cell.replace(" ", "")) for cell in cells(text)[1:]]
    return row | {"seconds": row["seconds"] + earlier[0], "inputs": row["inputs"] + int(earlier[1]),
                  "worst_ms": max(row["worst_ms"], earlier[5]), "worst_mb": max(row["worst_mb"], earlier[6])}


def place_in(document, row, all_targets):
    """Adds a row to the table between the marks of `fuzz`; those of other targets stay."""
    begin, end = "<!-- fuzz -->\n", "<!-- end -->"
    head, rest = document.read_text().split(begin)
    lines = {cells(text)[0]: text for text in rest[:rest.index(end)].splitlines()[3:] if text.startswith("|")}
    target = row["target"]
    lines[target] = line(with_earlier(row, lines[target]) if target in lines else row)
    body = [*HEADING, *(lines[target] for target in all_targets if target in lines)]
    document.write_text(head + begin + "\n" + "\n".join(body) + "\n\n" + rest[rest.index(end):])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    how_long = parser.add_mutually_exclusive_group()
    how_long.add_argument("--seconds", type=float, default=3600, help="of processor time for each target")
    how_long.add_argument("--briefly", action="store_true", help="twenty seconds by the clock for each of " + ", ".join(EVERYDAY) + "; five seconds for each other")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--targets", help="separated by commas; all where none is named")
    parser.add_argument("--corpus", type=pathlib.Path, default=ROOT / "out/fuzz")
    parser.add_argument("--document", type=pathlib.Path, help="where to put the rows, in the place marked `fuzz`")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    chosen = arguments.targets.split(",") if arguments.targets else targets(build)
    arguments.corpus.mkdir(parents=True, exist_ok=True)
    subprocess.run([build / "trihedron_fuzz_seeds", arguments.corpus / "seeds", ROOT / "examples"], check=True)
    seconds = (lambda target: 20 if target in EVERYDAY else 5) if arguments.briefly else (lambda target: arguments.seconds)
    rows = []
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for running in concurrent.futures.as_completed(pool.submit(fuzz, build, target, arguments.corpus, seconds(target), arguments.briefly) for target in chosen):
            rows.append(running.result())
            if arguments.document:
                place_in(arguments.document, rows[-1], targets(build))
    print(*HEADING, *map(line, sorted(rows, key=lambda row: row["target"])), sep="\n")
    return 1 if any(row["crashes"] + row["hangs"] + row["out_of_memory"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
