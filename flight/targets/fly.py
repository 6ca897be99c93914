#!/usr/bin/python3
"""Flies core away from the desktop: fly.py BUILD DOCUMENT.

Simulates the nine hours of examples/paper.toml, replays them on this machine, flies the records of that on every target of TARGETS, compares,
and writes the tables of the document, each between `<!-- NAME -->` and `<!-- end -->`. BUILD is where the program and trihedron_fly are.
Exit status 0: all gave the same bits and every limit is kept.
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
sys.path.append(str(ROOT / "core" / "interface"))
import tables

# What fly.cpp writes: an Outcome for each event, and an End.
ATTITUDE = [("t_ns", "i8"), ("q_in_c", "f8", 4), ("covariance", "f8", (3, 3))]
OUTCOME = numpy.dtype([("kind", "u8"), ("status", "u8"), ("call_cost", "u8"), ("attitude_cost", "u8"), *ATTITUDE])
OTHERS = {"housekeeping": "housekeeping record", "save": "snapshot", "restore": "restoring a snapshot", "correct_now": "command correct_now",
          "adopt": "command adopt_calibration", "hold": "command hold_calibration", "select": "command select_gyros", "reset": "command reset",
          "load": "command load_parameters", "start": "command start"}
END = numpy.dtype([("housekeeping", tables.layout("housekeeping")), ("restored", tables.layout("housekeeping")), ("measured", "u8"), ("stack_bytes", "u8"),
                   ("state_bytes", "u8"), *((f"{name}_cost", "u8") for name in OTHERS)])
KIND_SAMPLE = 1
SAMPLE_USED = 1
FIXES_USED = (2, 3, 4, 5)  # of trihedron_fix

KIB = 1024
PROCESSOR_HZ = 200e6
SAMPLES_PER_S = 8


@dataclasses.dataclass(frozen=True)
class Target:
    name: str
    what: str
    compiler: str
    emulator: tuple  # the command before the program and its arguments
    byte_order: str = "<"

    def command(self, program, records, result):
        if self.name == "cortex-m7":
            arguments = ",".join(f"arg={word}" for word in ("fly", records, result))
            return [*self.emulator, "-semihosting-config", f"enable=on,target=native,{arguments}", "-kernel", program]
        return [*self.emulator, program, records, result]

    def missing(self):
        """The programs that the target needs and this machine lacks."""
        return [name for name in (self.compiler, *self.emulator[:1]) if shutil.which(name) is None]


CORTEX_M7 = Target("cortex-m7", "ARM Cortex-M7, double-precision FPU, no operating system", "arm-none-eabi-g++",
                   ("qemu-system-arm", "-M", "mps2-an500", "-icount", "shift=0", "-nographic", "-monitor", "none", "-serial", "none"))
TARGETS = [
    CORTEX_M7,
    Target("s390x", "64 bits, most significant byte first", "s390x-linux-gnu-g++", ("qemu-s390x",), ">"),
    Target("sparc", "SPARC V8+, 32 bits, most significant byte first", "sparc64-linux-gnu-g++", ("qemu-sparc32plus",), ">"),
    Target("riscv64", "RISC-V, 64 bits", "riscv64-linux-gnu-g++", ("qemu-riscv64",)),
]


def run(command, **options):
    return subprocess.run([str(word) for word in command], check=True, text=True, **options)


def directory(target, build):
    return pathlib.Path(build) / "flight" / target.name


def built(target, build, *options):
    """Compiles core and the program that flies it, with further options of CMake; where that is.

    By the compiler itself: a cache of objects (CMAKE_CXX_COMPILER_LAUNCHER of the environment) would give back the object without the call graph
    that is written beside it.
    """
    place = directory(target, build)
    run(["cmake", "-S", HERE, "-B", place, "-G", "Ninja", "--toolchain", HERE / target.name / "toolchain.cmake", "-DCMAKE_CXX_COMPILER_LAUNCHER=", *options],
        stdout=subprocess.DEVNULL)
    run(["cmake", "--build", place], stdout=subprocess.DEVNULL)
    return place / "fly"


class Result:
    """What a flight came to, in the byte order of this machine."""

    def __init__(self, file, byte_order="<"):
        content = file.read_bytes()
        outcomes, end = content[:-END.itemsize], content[-END.itemsize:]
        self.outcomes = numpy.frombuffer(outcomes, OUTCOME.newbyteorder(byte_order)).astype(OUTCOME)
        self.end = numpy.frombuffer(end, END.newbyteorder(byte_order)).astype(END)[0]

    def attitudes(self):
        """The attitude after each sample used, where there was one."""
        is_used = (self.outcomes["kind"] == KIND_SAMPLE) & (self.outcomes["status"] == SAMPLE_USED)
        return self.outcomes[is_used & (self.outcomes["q_in_c"] != 0).any(axis=1)]

    def fixes_used(self):
        return int(self.end["housekeeping"]["fixes_used"])

    def is_restored(self):
        """Whether the snapshot gave what was there before the reset."""
        return self.end["restored"].tobytes() == self.end["housekeeping"].tobytes()

    def same_bits(self, other):
        columns = [name for name in OUTCOME.names if not name.endswith("_cost")]
        return (len(self.outcomes) == len(other.outcomes)
                and all(self.outcomes[name].tobytes() == other.outcomes[name].tobytes() for name in columns)
                and self.end["housekeeping"].tobytes() == other.end["housekeeping"].tobytes()
                and self.is_restored() and other.is_restored())

    def attitude_difference_rad(self, other):
        """The largest."""
        mine, others = self.outcomes["q_in_c"], other.outcomes["q_in_c"]
        return float(2 * numpy.minimum(numpy.abs(mine - others).max(), numpy.abs(mine + others).max()))

    def rows(self):
        """As `replay` writes its attitude: quaternion and sigmas of each sample used."""
        its = self.attitudes()
        sigmas = numpy.sqrt(numpy.einsum("nii->ni", its["covariance"]))
        return [[*(f"{value:.12f}" for value in q), *(f"{value:.6e}" for value in sigma)] for q, sigma in zip(its["q_in_c"], sigmas)]


def in_byte_order(records, byte_order):
    """Records of this machine for another: a table of parameters, and samples and fixes, which are words of eight bytes throughout."""
    head = numpy.dtype([("kind", "u8"), ("parameters", tables.layout("parameters"))])
    parameters = numpy.frombuffer(records, head, 1)
    return parameters.astype(head.newbyteorder(byte_order)).tobytes() + numpy.frombuffer(records, "u8", offset=head.itemsize).astype(f"{byte_order}u8").tobytes()


def flown(target, build, records, *options):
    """Of the records that replayed() wrote."""
    program = built(target, build, *options)
    its_records = directory(target, build) / records.name
    its_records.write_bytes(in_byte_order(records.read_bytes(), target.byte_order))
    result = its_records.with_suffix(".result")
    run(target.command(program, its_records, result), timeout=3600)
    return Result(result, target.byte_order)


def replayed(build, scenario, name, *options):
    """Simulates a pass and replays it on this machine, `options`: further arguments of `trihedron replay`. The records it was replayed from,
    and the lines of the attitude that came out."""
    folder = pathlib.Path(build) / "flight"
    folder.mkdir(parents=True, exist_ok=True)
    pass_directory, records, attitude = (folder / f"{name}.{kind}" for kind in ("pass", "records", "csv"))
    program = pathlib.Path(build) / "trihedron"
    run([program, "--quiet", "simulate", scenario, "-o", pass_directory])
    result = subprocess.run([program, "--quiet", "--json", "replay", pass_directory, "--speed", "max", *options, "--records", records, "-o",
                             attitude], capture_output=True, text=True)
    assert result.returncode in (0, 1), result.stderr  # 1: the calibration was not adopted
    return records, [line.split(",")[1:8] for line in attitude.read_text().splitlines()[1:]]


def flown_here(build, records):
    """The same program on this machine."""
    result = records.with_suffix(".result")
    run([pathlib.Path(build) / "trihedron_fly", records, result])
    return Result(result)


# ---- What was measured on the Cortex-M7

ROOTS = r"^\w+\*? trihedron_(create|load_parameters|command|on_gyro|on_fix|get_attitude|get_housekeeping|save|restore)\([^)]*\)$"
# Of the C and the compiler's library: they call nothing and take some words of stack.
LIBRARY = {"memcpy", "memset", "memmove", "frexp", "ldexp", "abort", "sqrt", "__aeabi_l2d", "__aeabi_d2lz", "__aeabi_ldivmod", "__aeabi_uldivmod"}
# Of a view of a covariance that could have copied it, and has not: `free` of a null pointer, by load_parameters alone.
FREE_OF_NOTHING = {"free"}
# Calls through a pointer: a row of kFurtherStateKinds, a member function of Layout; and the handler of failed assertions.
INDIRECT = "__indirect_call"


def call_graph(build):
    """Of each object file that the program is linked of. FileNotFoundError, with its name, where the compiler has written no graph beside one."""
    return CallGraph(sorted(file.with_suffix(".ci") for file in directory(CORTEX_M7, build).rglob("*.obj")))


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
    """What core keeps outside the object."""
    library = directory(CORTEX_M7, build) / "core" / "libtrihedron_core.a"
    lines = run(["arm-none-eabi-size", library], capture_output=True).stdout.splitlines()[1:]
    return sum(int(line.split()[1]) + int(line.split()[2]) for line in lines)


def slots(result):
    """Instructions of each slot: of a sample, and of the fixes that come before the next one."""
    outcomes = result.outcomes
    first = numpy.flatnonzero(outcomes["kind"] == KIND_SAMPLE)
    return numpy.add.reduceat(outcomes["call_cost"], first)


def costs(result):
    """Instructions by what was done: (name, median, largest, how often)."""
    attitudes = result.attitudes()["attitude_cost"]
    rows = [(name, int(numpy.median(its)), int(its.max()), len(its))
            for name, its in (("a slot", slots(result)), ("attitude with covariance", attitudes))]
    return rows + [(what, cost, cost, 1) for name, what in OTHERS.items() for cost in [int(result.end[f"{name}_cost"])]]


def worst_over_median(result):
    its = slots(result)
    return float(its.max() / numpy.median(its))


def average_share(result):
    """Of a 200 MHz processor at one instruction a cycle, with the attitude asked for at each sample."""
    total = result.outcomes["call_cost"].sum() + result.outcomes["attitude_cost"].sum()
    return float(total) / len(slots(result)) * SAMPLES_PER_S / PROCESSOR_HZ


@dataclasses.dataclass(frozen=True)
class Limit:
    what: str
    value: float
    limit: float
    unit: str

    def kept(self):
        return self.value < self.limit

    def row(self):
        return f"| {self.what} | {self.value:.2f} {self.unit} | {self.limit:g} {self.unit} |".replace("  |", " |")


def limits(result, build):
    graph = call_graph(build)
    deepest = max(graph.deepest(root)[0] for root in graph.find(ROOTS))
    image, core = text_bytes(build)
    return [Limit("state, and other static memory of core", (int(result.end["state_bytes"]) + static_bytes(build)) / KIB, 32, "KiB"),
            Limit("stack of a call, at most (by the call graph)", deepest / KIB, 16, "KiB"),
            Limit("stack of a call, as found in flight (painted)", int(result.end["stack_bytes"]) / KIB, 16, "KiB"),
            Limit("code and constants of core", core / KIB, 256, "KiB"),
            Limit("code and constants of the whole image, with newlib", image / KIB, 256, "KiB"),
            Limit("worst slot, of the median one", worst_over_median(result), 3, ""),
            Limit("average load of a 200 MHz processor at one instruction a cycle", 100 * average_share(result), 5, "%")]


# ---- The document

def place_tables(document, generated):
    text = document.read_text()
    for name, lines in generated.items():
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
    records, rows = replayed(build, ROOT / "examples" / "paper.toml", "paper")
    desktop = flown_here(build, records)
    results = {}
    for target in TARGETS:
        results[target] = flown(target, build, records)
        print(f"{target.name}: bits {'the same' if results[target].same_bits(desktop) else 'DIFFER'}", flush=True)
    measured = results[CORTEX_M7]
    kept = limits(measured, build)
    generated = {
        "targets": ["| target | what | compiler | bits of the results |", "|---|---|---|---|",
                    *(target_row(target, result, desktop) for target, result in results.items())],
        "limits": ["| | measured | limit |", "|---|---:|---:|", *(limit.row() for limit in kept)],
        "costs": ["| instructions of | median | largest | times |", "|---|---:|---:|---:|",
                  *(f"| {name} | {median} | {largest} | {count} |" for name, median, largest, count in costs(measured))],
    }
    place_tables(pathlib.Path(document), generated)
    print("\n".join(line for table in generated.values() for line in table))
    wrong = [limit.what for limit in kept if not limit.kept()]
    wrong += [target.name for target, result in results.items() if not result.same_bits(desktop)]
    wrong += ["attitude of replay"] if desktop.rows() != rows else []
    return f"flight: not kept: {', '.join(wrong)}" if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    os.environ.setdefault("LC_ALL", "C")
    sys.exit(main(sys.argv[1], sys.argv[2]))
