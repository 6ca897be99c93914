"""The dependency directions of cmake/Modules.cmake hold in what the sources include and in what the targets link: between modules,
and between the rooms of ground.

Run by CTest: python3 -m pytest architecture_test.py, with TRIHEDRON_BUILD naming the build directory.
"""
import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
MODULES_CMAKE = ROOT / "cmake" / "Modules.cmake"

# core flies: what needs a heap, exceptions, streams, files, threads or a clock does not belong there.
CORE_MAY_INCLUDE = {"array", "algorithm", "chrono", "cmath", "compare", "cstddef", "cstdint", "cstdlib", "cstring", "iterator", "limits", "memory", "numbers",
                    "optional", "span", "type_traits", "utility",
                    "stddef.h", "stdint.h", "trihedron.h", "trihedron_tables.h"}  # the interface in C


def table_of(prefix):
    rows = re.findall(rf"set\({prefix}_([a-z]+)_MAY_USE ?([\w ]*)\)", MODULES_CMAKE.read_text())
    return {name: set(uses.split()) for name, uses in rows}


def allowed():
    return table_of("TRIHEDRON")


def allowed_rooms():
    return table_of("TRIHEDRON_ground")


def includes(file):
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', file.read_text(), re.MULTILINE)


def wrong_includes(root, table):
    wrong = []
    for module, may_use in table.items():
        for file in sorted((root / module).glob("**/*")):
            if file.suffix not in (".hpp", ".cpp") or "test" in file.relative_to(root / module).parts:
                continue
            for included in includes(file):
                parts = included.split("/")
                if parts[0] == "trihedron":
                    bad = parts[1] != module and parts[1] not in may_use
                elif module == "core":
                    bad = parts[0] != "Eigen" and included not in CORE_MAY_INCLUDE and not (file.parent / included).exists()
                else:
                    bad = False
                if bad:
                    wrong.append(f"{file.relative_to(root)} includes {included}")
    return wrong


def room_of(path):
    """Of a path below src/ or include/trihedron/ground/: the folder that it begins with."""
    parts = pathlib.PurePath(path).parts
    return parts[0] if len(parts) > 1 else None


def wrong_rooms(ground, table):
    """What lies in no room, and what includes a room that its own may not use. Tests may use all."""
    wrong = []
    for base in (ground / "src", ground / "include" / "trihedron" / "ground"):
        for file in sorted(base.glob("**/*.?pp")):
            room = room_of(file.relative_to(base))
            name = file.relative_to(ground)
            if room not in table:
                wrong.append(f"{name} lies in no room")
                continue
            for included in includes(file):
                if included.startswith("trihedron/ground/"):
                    other = room_of(included.removeprefix("trihedron/ground/"))
                elif (ground / "src" / included).exists():
                    other = room_of(included)
                else:
                    continue
                if other != room and other not in table[room]:
                    wrong.append(f"{name} includes {included}")
    return wrong


def module_of(target):
    """Without the prefix of all, and io for the parts of io."""
    return re.sub(r"^io_(text|without_netcdf)$", "io", re.sub(r"^trihedron(_|::)", "", target))


def wrong_links(dot, table):
    names = dict(re.findall(r'"(node\d+)" \[ label = "([^"\\]+)', dot))
    wrong = []
    for left, right in re.findall(r'"(node\d+)" -> "(node\d+)"', dot):
        a, b = (module_of(names.get(node, "")) for node in (left, right))
        if a in table and b in table and a != b and b not in table[a]:
            wrong.append(f"{a} links {b}")
    return wrong


def assert_acyclic(table):
    def reach(module):
        found = set(table[module])
        for used in table[module]:
            found |= reach(used)  # a cycle ends in RecursionError
        return found

    assert all(module not in reach(module) for module in table)


def test_table_is_read_and_acyclic():
    table = allowed()
    assert {"core", "records", "sim", "io", "ground", "plan", "lanes", "campaign", "report", "cli", "python"} == set(table)
    assert table["core"] == set()
    assert_acyclic(table)


def test_table_of_rooms_is_read_and_acyclic():
    table = allowed_rooms()
    assert {room.name for room in (ROOT / "ground" / "src").iterdir()} <= set(table)
    assert table["model"] == set()
    assert_acyclic(table)


def test_sources_include_only_what_their_module_may_use():
    assert wrong_includes(ROOT, allowed()) == []


def test_rooms_of_ground_include_only_what_they_may_use():
    assert wrong_rooms(ROOT / "ground", allowed_rooms()) == []


def test_targets_link_only_what_their_module_may_use(tmp_path):
    graph = tmp_path / "graph.dot"
    subprocess.run(["cmake", f"--graphviz={graph}", os.environ["TRIHEDRON_BUILD"]], check=True, capture_output=True)
    dot = graph.read_text()
    assert "trihedron_core" in dot and "trihedron_io" in dot
    assert wrong_links(dot, allowed()) == []


def test_a_planted_include_is_found(tmp_path):
    for module in allowed():
        (tmp_path / module / "src").mkdir(parents=True)
    (tmp_path / "core" / "src" / "a.cpp").write_text('#include <vector>\n#include <cmath>\n#include "trihedron/io/pass.hpp"\n')
    (tmp_path / "sim" / "src" / "b.cpp").write_text('#include "trihedron/core/time.hpp"\n#include "trihedron/ground/judge/verdict.hpp"\n')
    assert wrong_includes(tmp_path, allowed()) == ["core/src/a.cpp includes vector",
                                                   "core/src/a.cpp includes trihedron/io/pass.hpp",
                                                   "sim/src/b.cpp includes trihedron/ground/judge/verdict.hpp"]


def test_a_planted_include_of_another_room_is_found(tmp_path):
    headers = tmp_path / "include" / "trihedron" / "ground" / "judge"
    headers.mkdir(parents=True)
    (headers / "verdict.hpp").write_text('#include "trihedron/ground/calibrate/calibrate.hpp"\n')
    for room, text in (("batch", '#include "choose/decide.hpp"\n#include "model/prior.hpp"\n#include "batch/refine.hpp"\n'),
                       ("choose", '#include "batch/batch.hpp"\n'), ("model", "")):
        (tmp_path / "src" / room).mkdir(parents=True)
        for name in ("batch", "decide", "prior", "refine"):
            (tmp_path / "src" / room / f"{name}.hpp").write_text("")
        (tmp_path / "src" / room / "a.cpp").write_text(text)
    (tmp_path / "src" / "flat.cpp").write_text("")
    assert wrong_rooms(tmp_path, allowed_rooms()) == [
        "src/batch/a.cpp includes choose/decide.hpp", "src/flat.cpp lies in no room",
        "include/trihedron/ground/judge/verdict.hpp includes trihedron/ground/calibrate/calibrate.hpp"]


def test_a_planted_link_is_found():
    dot = '"node0" [ label = "trihedron_core\\n(trihedron::core)" ];\n"node1" [ label = "trihedron_io\\n(x)" ];\n"node0" -> "node1"'
    assert wrong_links(dot, allowed()) == ["core links io"]
    dot = dot.replace("trihedron_io", "trihedron_io_without_netcdf")
    assert wrong_links(dot, allowed()) == ["core links io"]
    assert wrong_links(dot.replace("_core", "_python").replace("::core", "::python"), allowed()) == []


def test_kernels_for_newer_processors_share_no_function_with_the_rest():
    """Of functions that several objects define the linker keeps any one, and that of these kernels would not run everywhere."""
    kernels = "for_avx2"
    build = pathlib.Path(os.environ["TRIHEDRON_BUILD"])
    if "CMAKE_BUILD_TYPE:STRING=Release" not in (build / "CMakeCache.txt").read_text():
        pytest.skip("only an optimised build leaves no small functions")
    objects = list((build / "ground" / "CMakeFiles" / f"trihedron_{kernels}.dir").rglob("*.o"))
    if not objects:
        pytest.skip("no such kernels for this processor")
    names = subprocess.run(["nm", "--demangle", "--defined-only", *objects], check=True, capture_output=True, text=True).stdout
    functions = re.findall(r"^\w+ [TWuV] (.*)$", names, re.MULTILINE)
    assert any(f"::{kernels}::" in name for name in functions)
    assert [name for name in functions if kernels not in name and not name.startswith("DW.ref.")] == []
