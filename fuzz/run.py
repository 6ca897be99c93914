#!/usr/bin/env python3
"""Runs every fuzz target for a time, and prints what came of it: inputs tried, crashes, hangs, worst time, worst memory.

    fuzz/run.py BUILD [--seconds 3600] [--jobs 2] [--targets csv,netcdf] [--corpus DIRECTORY] [--document docs/reliability.md]

Begins with the seeds that BUILD/trihedron_fuzz_seeds writes, the inputs of fuzz/regressions, and what earlier runs have left in the corpus.
A target goes on after a crash until its time is over. Exit status 1 where anything was found; the inputs that did it are in the corpus'
directory `found`, and are tried again by: BUILD/fuzz_TARGET FILE.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
LIMIT_S = 10
LIMIT_MB = 1024  # resident, with all that the sanitizers add
LONGEST = {"netcdf": 200_000, "catalogue": 100_000, "calibration": 40_000, "truth": 40_000, "csv": 20_000, "scenario": 20_000}  # bytes
SANITIZERS = {"ASAN_OPTIONS": "allocator_may_return_null=0:detect_stack_use_after_return=0", "UBSAN_OPTIONS": "print_stacktrace=1"}


def targets(build):
    return sorted(path.name.removeprefix("fuzz_") for path in build.glob("fuzz_*") if os.access(path, os.X_OK) and path.is_file())


def figure(name, text):
    found = re.findall(rf"stat::{name}: +([\d.]+)", text)
    return float(found[-1]) if found else 0.0


def fuzz(build, target, corpus, seconds):
    """One row of the table."""
    own, found = corpus / target, corpus / "found"
    for directory in (own, found):
        directory.mkdir(parents=True, exist_ok=True)
    before = {path.name for path in found.iterdir()}
    seeds = [path for path in (corpus / "seeds" / target, ROOT / "fuzz" / "regressions" / target) if path.exists()]
    row = {"target": target, "inputs": 0, "worst_ms": 0.0, "worst_mb": 0.0}
    begun = time.monotonic()
    while (left := seconds - (time.monotonic() - begun)) >= 1:
        command = [build / f"fuzz_{target}", own, *seeds, f"-max_total_time={int(left)}", f"-timeout={LIMIT_S}", f"-rss_limit_mb={LIMIT_MB}",
                   f"-max_len={LONGEST.get(target, 4096)}", f"-artifact_prefix={found}/{target}-", "-print_final_stats=1", "-verbosity=1",
                   "-close_fd_mask=1", "-use_value_profile=1"]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, errors="replace",
                              env={**os.environ, **SANITIZERS}, check=False)
        (corpus / f"{target}.log").write_text(done.stderr)
        row["inputs"] += int(figure("number_of_executed_units", done.stderr))
        row["worst_ms"] = max(row["worst_ms"], figure("worst_time_ms", done.stderr), 1000 * figure("slowest_unit_time_sec", done.stderr))
        row["worst_mb"] = max(row["worst_mb"], figure("peak_rss_mb", done.stderr))
        if done.returncode == 0:
            break
    new = [path.name for path in found.iterdir() if path.name.startswith(target + "-") and path.name not in before]
    row["crashes"] = sum(name.startswith((f"{target}-crash", f"{target}-leak")) for name in new)
    row["hangs"] = sum(name.startswith((f"{target}-timeout", f"{target}-slow")) for name in new)
    row["out_of_memory"] = sum(name.startswith(f"{target}-oom") for name in new)
    row["seconds"] = time.monotonic() - begun
    print(f"{target}: {row['inputs']} inputs in {row['seconds']:.0f} s, found {new or 'nothing'}", flush=True)
    return row


def table(rows):
    lines = ["| target | time, s | inputs tried | crashes | hangs | out of memory | worst time, ms | worst memory, MB |",
             "|---|---:|---:|---:|---:|---:|---:|---:|"]
    for row in rows:
        lines.append(f"| {row['target']} | {row['seconds']:.0f} | {row['inputs']:,} | {row['crashes']} | {row['hangs']} | "
                     f"{row['out_of_memory']} | {row['worst_ms']:.0f} | {row['worst_mb']:.0f} |".replace(",", " "))
    return "\n".join(lines) + "\n"


def write_between_markers(document, place, text):
    page = document.read_text()
    begin, end = f"<!-- {place} -->\n", "<!-- end -->"
    head, rest = page.split(begin)
    document.write_text(head + begin + text + rest[rest.index(end):])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=3600, help="of each target")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--targets", help="separated by commas; all where none is named")
    parser.add_argument("--corpus", type=pathlib.Path, default=ROOT / "out/fuzz")
    parser.add_argument("--document", type=pathlib.Path, help="where to put the table, in the place marked `fuzz`")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    chosen = arguments.targets.split(",") if arguments.targets else targets(build)
    arguments.corpus.mkdir(parents=True, exist_ok=True)
    subprocess.run([build / "trihedron_fuzz_seeds", arguments.corpus / "seeds", ROOT / "examples"], check=True)
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        rows = list(pool.map(lambda target: fuzz(build, target, arguments.corpus, arguments.seconds), chosen))
    print(table(rows), end="")
    if arguments.document:
        write_between_markers(arguments.document, "fuzz", "\n" + table(rows) + "\n")
    return 1 if any(row["crashes"] + row["hangs"] + row["out_of_memory"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
