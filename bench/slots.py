#!/usr/bin/env python3
"""Instructions of each slot of the on-board application: slots.py SLOTS, the program of slots.cpp, which runs under valgrind.

Ends with 1 where the worst slot takes more than three times the median one, also where something happens."""
import concurrent.futures
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

LARGEST_RATIO = 3
STEADY = "slot: a fix every 3 s"
SLOTS = ["slot: a fix every 3 s", "slot: a fix every 2.5 to 3 s", "slot: a fix every 1 s", "slot: corrected every 90 min",
         "slot: no star tracker", "slot: spread over 1000 samples", "slot: a fix every 3 s, then every 1 s"]
# Between slots in which little can be done: of them the worst is compared with the median of STEADY.
EVENTS = ["slot: the clock is set back", "slot: gaps of the gyros", "slot: the star tracker jumps"]
FURTHER = ["guarded slot: a fix every 3 s", "not spread: a fix every 3 s", "not spread: no star tracker", "others"]


def measured(program, kind):
    """Counts by name."""
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["valgrind", "--tool=callgrind", "--instr-atstart=no", f"--callgrind-out-file={folder}/out", program, kind],
                       check=True, capture_output=True)
        for file in pathlib.Path(folder).iterdir():
            text = file.read_text()
            name = re.search(r"^desc: Trigger: Client Request: (.*)$", text, re.MULTILINE)
            if name:
                counts.setdefault(name.group(1), []).append(int(re.search(r"^totals: (\d+)", text, re.MULTILINE).group(1)))
    return counts


def ratio(counts, steady=None):
    """Of the worst to the median, of the same or of other slots."""
    return max(counts) / statistics.median(steady or counts)


def main():
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        found = {}
        for counts in pool.map(lambda kind: measured(sys.argv[1], kind), SLOTS + EVENTS + FURTHER):
            found.update(counts)
    print(f"{'instructions':40} {'median':>9} {'mean':>9} {'worst':>9} {'worst/median':>13}")
    ratios = {name: ratio(its, found[STEADY] if name in EVENTS else None) for name, its in found.items()}
    for name, its in found.items():
        print(f"{name:40} {statistics.median(its):9.0f} {statistics.mean(its):9.0f} {max(its):9d} {ratios[name]:13.1f}")
    uneven = [name for name in SLOTS + EVENTS if ratios[name] > LARGEST_RATIO]
    for name in uneven:
        print(f"{name}: the worst takes more than {LARGEST_RATIO} times the median", file=sys.stderr)
    return 1 if uneven else 0


if __name__ == "__main__":
    sys.exit(main())
