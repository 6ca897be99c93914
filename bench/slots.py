#!/usr/bin/env python3
"""Instructions of each slot of the on-board application: slots.py SLOTS, the program of slots.cpp, which runs under valgrind."""
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile


def main():
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["valgrind", "--tool=callgrind", "--instr-atstart=no", f"--callgrind-out-file={folder}/out", sys.argv[1]],
                       check=True, capture_output=True)
        for file in pathlib.Path(folder).iterdir():
            text = file.read_text()
            name = re.search(r"^desc: Trigger: Client Request: (.*)$", text, re.MULTILINE)
            if name:
                counts.setdefault(name.group(1), []).append(int(re.search(r"^totals: (\d+)", text, re.MULTILINE).group(1)))
    print(f"{'instructions':28} {'median':>9} {'mean':>9} {'worst':>9} {'worst/median':>13}")
    for name, its in counts.items():
        median = statistics.median(its)
        print(f"{name:28} {median:9.0f} {statistics.mean(its):9.0f} {max(its):9d} {max(its) / median:13.1f}")


if __name__ == "__main__":
    main()
