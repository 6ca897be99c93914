#!/usr/bin/python3
"""Flies core away from the desktop: fly.py BUILD DOCUMENT.

Simulates the nine hours of examples/paper.toml, flies them on every target of TARGETS, compares the results with the desktop's, and
writes the tables of the document, each between `<!-- NAME -->` and `<!-- end -->`. BUILD is where the program and trihedron_feed are.
Exit status 0: all targets gave the same bits and every limit is kept.
"""
import dataclasses
import os
import pathlib
import re
import shutil
import subprocess
import sys

import numpy

from call_graph import CallGraph

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

# A record of fly.cpp, and what follows the last one.
RECORD = numpy.dtype([("kind", "<u8"), ("t_ns", "<i8"), ("sample", "<u8"), ("fix", "<u8"), ("nis", "<f8"), ("C_in_c", "<f8", (3, 3)),
                      ("covariance", "<f8", 6), ("step_cost", "<u8"), ("attitude_cost", "<u8")])
GYROS, STATES = 2, 26
CALIBRATION_WORDS = GYROS * (3 + 7 + 9) + STATES * STATES
KIND_GYRO = 1
FIX_NONE, FIX_PENDING = 0, 1

KIB = 1024
PROCESSOR_HZ = 200e6
SAMPLES_PER_S = 8


@dataclasses.dataclass(frozen=True)
class Target:
    name: str
    what: str
    compiler: str
    emulator: tuple  # the command before the program and its arguments; empty: none is needed

    def command(self, program, feed, result):
        if self.name == "cortex-m7":
            arguments = ",".join(f"arg={word}" for word in ("fly", feed, result))
            return [*self.emulator, "-semihosting-config", f"enable=on,target=native,{arguments}", "-kernel", program]
        return [*self.emulator, program, feed, result]

    def missing(self):
        """The programs that the target needs and this machine lacks."""
        return [name for name in (self.compiler, *self.emulator[:1]) if shutil.which(name) is None]


DESKTOP = Target("desktop", "this machine", "g++", ())
CORTEX_M7 = Target("cortex-m7", "ARM Cortex-M7, double-precision FPU, no operating system", "arm-none-eabi-g++",
                   ("qemu-system-arm", "-M", "mps2-an500", "-icount", "shift=0", "-nographic", "-monitor", "none", "-serial", "none"))
TARGETS = [
    CORTEX_M7,
    Target("s390x", "64 bits, most significant byte first", "s390x-linux-gnu-g++", ("qemu-s390x",)),
    Target("sparc", "SPARC V8+, 32 bits, most significant byte first", "sparc64-linux-gnu-g++", ("qemu-sparc32plus",)),
    Target("riscv64", "RISC-V, 64 bits", "riscv64-linux-gnu-g++", ("qemu-riscv64",)),
]


def run(command, **options):
    return subprocess.run([str(word) for word in command], check=True, text=True, **options)


def directory(target, build):
    return pathlib.Path(build) / "flight" / target.name


def built(target, build):
    """Compiles core and the program that flies it; where that is."""
    place = directory(target, build)
    toolchain = [] if target is DESKTOP else ["--toolchain", HERE / target.name / "toolchain.cmake"]
    run(["cmake", "-S", HERE, "-B", place, "-G", "Ninja", *toolchain], stdout=subprocess.DEVNULL)
    run(["cmake", "--build", place], stdout=subprocess.DEVNULL)
    return place / "fly"


class Result:
    """What a target wrote."""

    def __init__(self, file):
        words = numpy.fromfile(file, dtype="<u8")
        tail = CALIBRATION_WORDS + 4
        records = words[1:-tail - 1]  # before them the format, after them the mark of the end
        self.records = records.view(RECORD)
        self.calibration = words[-tail:-4]
        self.measured, self.stack_bytes, self.object_bytes, self.report_bytes = (int(word) for word in words[-4:])

    def same_bits(self, other):
        mine, others = self.records, other.records
        columns = [name for name in RECORD.names if not name.endswith("_cost")]
        return (len(mine) == len(others) and all(mine[name].tobytes() == others[name].tobytes() for name in columns)
                and self.calibration.tobytes() == other.calibration.tobytes())

    def attitude_difference_rad(self, other):
        """The largest."""
        turn = numpy.swapaxes(self.records["C_in_c"], 1, 2) @ other.records["C_in_c"]
        odd = turn - numpy.swapaxes(turn, 1, 2)
        return float(numpy.sqrt((odd**2).sum(axis=(1, 2)) / 8).max())


def flown(target, build, feed):
    program = built(target, build)
    result = directory(target, build) / f"{pathlib.Path(feed).stem}.result"
    run(target.command(program, feed, result), timeout=1800)
    return Result(result)


def feed_of(build, scenario, name):
    """Simulates a pass and makes its feed."""
    build = pathlib.Path(build)
    directory(DESKTOP, build).parent.mkdir(parents=True, exist_ok=True)
    pass_directory = build / "flight" / f"{name}.pass"
    feed = build / "flight" / f"{name}.feed"
    run([build / "trihedron", "--quiet", "simulate", scenario, "-o", pass_directory])
    run([build / "trihedron_feed", pass_directory, feed])
    return feed


# ---- What was measured on the Cortex-M7

ROOTS = r"::OnBoard<.*::(on_gyro|on_fix|carry_on|flush|navigation_attitude)\("
# Of the C and the compiler's library: they call nothing and take some words of stack.
LIBRARY = {"memcpy", "memset", "memmove", "frexp", "ldexp", "abort", "sqrt", "__aeabi_l2d", "__aeabi_d2lz", "__aeabi_ldivmod", "__aeabi_uldivmod"}
# Calls through a pointer: a row of kFurtherStateKinds, a member function of Layout; and the handler of failed assertions.
INDIRECT = "__indirect_call"


def call_graph(build):
    return CallGraph(sorted(directory(CORTEX_M7, build).rglob("*.ci")))


def text_bytes(build):
    """Code and constants: of the whole image, and of core in it."""
    program = directory(CORTEX_M7, build) / "fly"
    lines = run(["arm-none-eabi-nm", "-S", "-C", "--defined-only", program], capture_output=True).stdout.splitlines()
    core = 0
    for line in lines:
        parts = line.split(maxsplit=3)
        if len(parts) == 4 and parts[2] in "TtRrWwVv" and re.search("trihedron::|Eigen::", parts[3]) and "targets::" not in parts[3]:
            core += int(parts[1], 16)
    sizes = run(["arm-none-eabi-size", program], capture_output=True).stdout.splitlines()[1].split()
    return int(sizes[0]), core


def static_bytes(build):
    """What core keeps outside the on-board object."""
    library = directory(CORTEX_M7, build) / "core" / "libtrihedron_core.a"
    lines = run(["arm-none-eabi-size", library], capture_output=True).stdout.splitlines()[1:]
    return sum(int(line.split()[1]) + int(line.split()[2]) for line in lines)


def costs(result):
    """Instructions by what was done: (name, median, largest, how often)."""
    records = result.records
    is_sample = records["kind"] == KIND_GYRO
    deals_with_fix = (records["fix"] != FIX_NONE) & (records["fix"] != FIX_PENDING)
    attitude = records["attitude_cost"][is_sample & (records["C_in_c"][:, 0, 0] != 0)]
    rows = [("a sample", records["step_cost"][is_sample & ~deals_with_fix]),
            ("a sample that deals with a fix", records["step_cost"][is_sample & deals_with_fix]),
            ("a fix put into the queue", records["step_cost"][~is_sample & ~deals_with_fix]),
            ("attitude with covariance", attitude)]
    return [(name, int(numpy.median(cost)), int(cost.max()), len(cost)) for name, cost in rows]


def average_share(result):
    """Of a 200 MHz processor at one instruction a cycle, with the attitude asked for at each sample."""
    records = result.records
    is_sample = records["kind"] == KIND_GYRO
    total = records["step_cost"].sum() + records["attitude_cost"][is_sample].sum()
    return float(total) / is_sample.sum() * SAMPLES_PER_S / PROCESSOR_HZ


@dataclasses.dataclass(frozen=True)
class Limit:
    what: str
    value: float
    limit: float
    unit: str

    def kept(self):
        return self.value < self.limit

    def row(self):
        return f"| {self.what} | {self.value:.2f} {self.unit} | {self.limit:g} {self.unit} |"


def limits(result, build):
    graph = call_graph(build)
    deepest = max(graph.deepest(root)[0] for root in graph.find(ROOTS))
    image, core = text_bytes(build)
    return [Limit("on-board object and other static memory of core", (result.object_bytes + static_bytes(build)) / KIB, 32, "KiB"),
            Limit("stack of a call, at most (by the call graph)", deepest / KIB, 16, "KiB"),
            Limit("stack of a call, as found in flight (painted)", result.stack_bytes / KIB, 16, "KiB"),
            Limit("code and constants of core", core / KIB, 256, "KiB"),
            Limit("code and constants of the whole image, with newlib", image / KIB, 256, "KiB"),
            Limit("average load of a 200 MHz processor at one instruction a cycle", 100 * average_share(result), 5, "%")]


# ---- The document

def place_tables(document, tables):
    text = document.read_text()
    for name, lines in tables.items():
        pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        assert pattern.search(text), f"{document} has no place for {name}"
        text = pattern.sub(lambda match: match[1] + "\n".join(lines) + "\n" + match[2], text)
    document.write_text(text)


def version(program):
    return run([program, "--version"], capture_output=True).stdout.splitlines()[0]


def target_row(target, result, desktop):
    same = "the same" if result.same_bits(desktop) else f"differ, attitude by {result.attitude_difference_rad(desktop):.1e} rad at most"
    return f"| {target.name} | {target.what} | {version(target.compiler)} | {same} |"


def main(build, document):
    for target in TARGETS:
        if target.missing():
            sys.exit(f"flight: {', '.join(target.missing())} missing; `make flight` installs it")
    feed = feed_of(build, ROOT / "examples" / "paper.toml", "paper")
    desktop = flown(DESKTOP, build, feed)
    results = {}
    for target in TARGETS:
        results[target] = flown(target, build, feed)
        print(f"{target.name}: bits {'the same' if results[target].same_bits(desktop) else 'DIFFER'}", flush=True)
    measured = results[CORTEX_M7]
    kept = limits(measured, build)
    tables = {
        "targets": ["| target | what | compiler | bits of the results |", "|---|---|---|---|",
                    *(target_row(target, result, desktop) for target, result in results.items())],
        "limits": ["| | measured | limit |", "|---|---:|---:|", *(limit.row() for limit in kept)],
        "costs": ["| instructions of | median | largest | times |", "|---|---:|---:|---:|",
                  *(f"| {name} | {median} | {largest} | {count} |" for name, median, largest, count in costs(measured))],
    }
    place_tables(pathlib.Path(document), tables)
    print("\n".join(line for table in tables.values() for line in table))
    wrong = [limit.what for limit in kept if not limit.kept()]
    wrong += [target.name for target, result in results.items() if not result.same_bits(desktop)]
    return f"flight: not kept: {', '.join(wrong)}" if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    os.environ.setdefault("LC_ALL", "C")
    sys.exit(main(sys.argv[1], sys.argv[2]))
