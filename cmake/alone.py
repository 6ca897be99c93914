#!/usr/bin/env python3
"""Reads each source of a build directory without units by the compiler, and fails where one does not stand by itself."""

import argparse
import json
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


def without_output(command: str) -> list[str]:
    """The command without what it writes."""
    words = shlex.split(command)
    for option in ("-o", "-MT", "-MF"):
        while option in words:
            at = words.index(option)
            del words[at : at + 2]
    return [word for word in words if word not in ("-c", "-MD")]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    commands = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        # Those in the build directory are written by the build, which has not run.
        if entry["file"].endswith(".cpp") and not Path(entry["file"]).is_relative_to(build):
            commands.setdefault(entry["file"], entry)

    def read(entry: dict[str, str]) -> str:
        command = [*without_output(entry["command"]), "-fsyntax-only"]
        return subprocess.run(command, cwd=entry["directory"], capture_output=True, text=True, check=False).stderr

    with ThreadPoolExecutor(arguments.jobs) as pool:
        complaints = [text for text in pool.map(read, commands.values()) if text]
    print(*complaints, sep="\n", file=sys.stderr, end="")
    print(f"{len(commands)} sources, {len(complaints)} with complaints")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
