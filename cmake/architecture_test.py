"""The dependency directions of cmake/Modules.cmake hold in what the sources include and in what the targets link.

Run by CTest: python3 -m pytest architecture_test.py, with TRIHEDRON_BUILD naming the build directory.
"""
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
MODULES_CMAKE = ROOT / "cmake" / "Modules.cmake"

# core flies: what needs a heap, exceptions, streams, files, threads or a clock does not belong there.
CORE_MAY_INCLUDE = {"array", "algorithm", "chrono", "cmath", "cstddef", "cstdint", "cstdlib", "limits", "numbers", "optional",
                    "type_traits", "utility"}


def allowed():
    rows = re.findall(r"set\(TRIHEDRON_(\w+)_MAY_USE ?([\w ]*)\)", MODULES_CMAKE.read_text())
    return {name: set(uses.split()) for name, uses in rows}


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


def wrong_links(dot, table):
    names = dict(re.findall(r'"(node\d+)" \[ label = "([^"\\]+)', dot))
    wrong = []
    for left, right in re.findall(r'"(node\d+)" -> "(node\d+)"', dot):
        a, b = (re.sub(r"^trihedron(_|::)", "", names.get(node, "")) for node in (left, right))
        if a in table and b in table and b not in table[a]:
            wrong.append(f"{a} links {b}")
    return wrong


def test_table_is_read_and_acyclic():
    table = allowed()
    assert {"core", "records", "sim", "io", "ground", "plan", "report", "cli"} == set(table)
    assert table["core"] == set()

    def reach(module):
        found = set(table[module])
        for used in table[module]:
            found |= reach(used)  # a cycle ends in RecursionError
        return found

    assert all(module not in reach(module) for module in table)


def test_sources_include_only_what_their_module_may_use():
    assert wrong_includes(ROOT, allowed()) == []


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
    (tmp_path / "sim" / "src" / "b.cpp").write_text('#include "trihedron/core/time.hpp"\n#include "trihedron/ground/verdict.hpp"\n')
    assert wrong_includes(tmp_path, allowed()) == ["core/src/a.cpp includes vector",
                                                   "core/src/a.cpp includes trihedron/io/pass.hpp",
                                                   "sim/src/b.cpp includes trihedron/ground/verdict.hpp"]


def test_a_planted_link_is_found():
    dot = '"node0" [ label = "trihedron_core\\n(trihedron::core)" ];\n"node1" [ label = "trihedron_io\\n(x)" ];\n"node0" -> "node1"'
    assert wrong_links(dot, allowed()) == ["core links io"]
