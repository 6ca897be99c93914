#!/usr/bin/env python3
"""Runs the commands that pages of docs/ show, in the order of the page, and tells where they print something else than the page says.

    docs/shown.py BUILD [--write] [PAGE…]

BUILD has the program. With --write what they print is put into the page. A page is run as a reader would: in one shell, in a directory that has
build/ and examples/ as a checkout has them. Its blocks:

- ```console: lines that begin with "$ " are commands (with the lines that a backslash at the end joins to them), the others what they print. A
  command that fails must be followed by `$ echo $?`.
- ```{code-block} LANGUAGE with :caption: NAME is a file that the reader writes.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field

ROOT = pathlib.Path(__file__).resolve().parent.parent
END = "\x1e"  # stands, with the exit status, after what a command prints


@dataclass
class Command:
    text: str
    shown: list[str] = field(default_factory=list)
    printed: list[str] = field(default_factory=list)
    status: int = 0


@dataclass
class File:
    name: str
    text: str


def pages():
    """That show commands and what these print."""
    return sorted(path for path in (ROOT / "docs").glob("**/*.md") if "\n```console\n" in path.read_text())


def blocks(text):
    """(kind, lines) of the text: "prose", "console", "file" or "sh", the fences with it."""
    result, lines, fence = [], [], None
    for line in text.splitlines():
        if fence is None and (opening := re.match(r"(`{3,})(console$|sh$|\{code-block\})?", line)):
            result.append(("prose", lines))
            fence, kind, lines = opening[1], {"{code-block}": "file", None: "prose"}.get(opening[2], opening[2]), [line]
        elif fence is not None and line == fence:
            result.append((kind, [*lines, line]))
            fence, lines = None, []
        else:
            lines.append(line)
    return [*result, ("prose", lines)]


def commands_of(lines):
    result = []
    for line in lines:
        if line.startswith("$ "):
            result.append(Command(line[2:]))
        elif result[-1].text.endswith("\\") and not result[-1].shown:
            result[-1].text += "\n" + line
        else:
            result[-1].shown.append(line)
    return result


def file_of(lines):
    """The file that a code block with a caption is; None where it has none."""
    body = next(i for i, line in enumerate(lines[1:], 1) if not line.startswith(":"))
    caption = next((line.split(":caption:")[1].strip() for line in lines[1:body] if line.startswith(":caption:")), None)
    return File(caption, "\n".join(lines[body:-1]).strip("\n") + "\n") if caption else None


def steps_of(text):
    result = []
    for kind, lines in blocks(text):
        if kind == "console":
            result += commands_of(lines[1:-1])
        elif kind == "file" and (its := file_of(lines)):
            result.append(its)
    return result


def run(text, build, work):
    """The commands of a page with what they print, run in this directory."""
    work.mkdir(parents=True, exist_ok=True)
    for name, target in (("build", build), ("examples", ROOT / "examples"), ("core", ROOT / "core"), ("docs", ROOT / "docs")):
        (work / name).unlink(missing_ok=True)
        (work / name).symlink_to(target.resolve())
    steps = steps_of(text)
    script = ["exec 2>&1 </dev/null"]
    for step in steps:
        if isinstance(step, File):
            script.append(f"cat >'{step.name}' <<'END OF THE FILE'\n{step.text}END OF THE FILE")
        else:
            script.append(f"{step.text}\nstatus=$?; printf '\\n{END}%s\\n' $status; (exit $status)")
    environment = {"PATH": f"{work / 'build'}:{os.environ['PATH']}", "HOME": str(work), "LC_ALL": "C.UTF-8", "NO_COLOR": "1", "TZ": "UTC"}
    done = subprocess.run(["bash", "-c", "\n".join(script)], cwd=work, env=environment, stdout=subprocess.PIPE, text=True, timeout=300, check=False)
    printed = re.split(f"\n{END}(\\d+)\n", done.stdout)
    commands = [step for step in steps if isinstance(step, Command)]
    if len(printed) != 2 * len(commands) + 1:
        raise RuntimeError(f"the shell ended after {(len(printed) - 1) // 2} of {len(commands)} commands:\n{done.stdout}")
    for command, output, status in zip(commands, printed[::2], printed[1::2]):
        command.printed = [line.rstrip() for line in output.rstrip("\n").split("\n")] if output.strip() else []
        command.status = int(status)
    return commands


NUMBER = re.compile(r"(?<![\w.])[-−+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def agree(shown, printed):
    """Whether two lines say the same. A number with a decimal point may differ by one in its last digit, or by a millionth: on another processor
    sums have another order, and the last bit of a sine may decide how a number is rounded."""
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    for ours, theirs in zip(NUMBER.findall(shown), NUMBER.findall(printed)):
        if ours != theirs:
            a, b = (float(its.replace("−", "-")) for its in (ours, theirs))
            mantissa, _, exponent = ours.lower().partition("e")
            digits = len(mantissa.partition(".")[2])
            if not digits or abs(a - b) > max(1.001 * 10.0 ** (int(exponent or 0) - digits), 1e-6 * abs(a)):
                return False
    return True


def complaints(commands):
    """What the page says wrong, as lines of text."""
    result = []
    for command, following in zip(commands, [*commands[1:], None]):
        if command.status != 0 and (following is None or following.text != "echo $?"):
            result.append(f"$ {command.text}\nends with {command.status}, and the page does not show it: {command.printed}")
        if len(command.shown) != len(command.printed) or not all(map(agree, command.shown, command.printed)):
            result.append("\n".join([f"$ {command.text}", "the page says:", *command.shown, "it prints:", *command.printed]))
    return result


def rewritten(text, commands):
    """The page with what they print."""
    waiting = iter(commands)
    lines = []
    for kind, block in blocks(text):
        if kind != "console":
            lines += block
            continue
        lines.append(block[0])
        for _ in commands_of(block[1:-1]):
            command = next(waiting)
            lines += [f"$ {command.text}", *command.printed]
        lines.append(block[-1])
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("pages", type=pathlib.Path, nargs="*")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_intermixed_args()
    wrong = 0
    for page in arguments.pages or pages():
        text = page.read_text()
        with tempfile.TemporaryDirectory() as work:
            commands = run(text, arguments.build, pathlib.Path(work))
        if arguments.write:
            page.write_text(rewritten(text, commands))
            commands = [command for command in commands if command.status != 0]
            for command in commands:
                command.shown = command.printed
        found = complaints(commands) if not arguments.write else [f"$ {its.text}\nended with {its.status}" for its in commands]
        wrong += len(found)
        for complaint in found:
            print(f"{page}: {complaint}\n")
    sys.exit(1 if wrong and not arguments.write else 0)


if __name__ == "__main__":
    main()
