"""What docs/flight-standard.md forbids in core is not there, and its tables of exceptions are complete.

Run by CTest: python3 -m pytest standard_test.py.
"""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FORBIDDEN = ["goto", "setjmp", "longjmp", "new", "delete", "malloc", "free", "throw", "try", "catch", "dynamic_cast", "typeid", "const_cast",
             "reinterpret_cast", "union", "volatile", "asm", "do"]
LOOP = re.compile(r"\bwhile \(.*|\bfor \(;.*")
POINTER_TO_FUNCTION = re.compile(r".*\([\w:]*\*\w*\)\(.*")


def code_of(text):
    """The lines of code, without comments and the text of literals."""
    text = re.sub(r'"(\\.|[^"\\])*"', '""', text)
    return [line.split("//")[0].strip() for line in text.splitlines()]


def sources():
    files = [*(ROOT / "core" / "src").rglob("*.?pp"), *(ROOT / "core" / "include").rglob("*.?pp")]
    return {str(file.relative_to(ROOT)): code_of(file.read_text()) for file in sorted(files)}


def found(pattern, files):
    return {(name, match[0].strip()) for name, lines in files.items() for line in lines if (match := pattern.search(line))}


def table(heading):
    """First and second column of the table below a heading."""
    text = (ROOT / "docs" / "flight-standard.md").read_text()
    section = re.search(rf"^## {heading}$(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)[1]
    return set(re.findall(r"^\| `([^`]+)` \| `([^`]+)` \|", section, re.MULTILINE))


def forbidden(files):
    return [f"{name}: {word}" for name, lines in files.items() for line in lines for word in FORBIDDEN
            if re.search(rf"(?<![\w#.>-]){word}\b(?! *=)", line)]


def test_nothing_forbidden_is_there():
    assert len(sources()) > 30
    assert forbidden(sources()) == []


def test_loops_without_a_counter_stand_in_the_document_with_their_bound():
    assert found(LOOP, sources()) == table("Loops without a counter")


def test_pointers_to_functions_stand_in_the_document():
    assert found(POINTER_TO_FUNCTION, sources()) == table("Calls through a pointer")


def requirements():
    """Each requirement with the tests that its row names."""
    text = (ROOT / "docs" / "flight-standard.md").read_text()
    section = re.search(r"^## Requirements of the on-board application$(.*?)(?=^## )", text, re.DOTALL | re.MULTILINE)[1]
    rows = re.findall(r"^\| (?!requirement)(?!-)(.+?) \| (.+?) \|$", section, re.MULTILINE)
    return {requirement: re.findall(r"`([^`]+)`", tests) for requirement, tests in rows if not requirement.startswith("-")}


def missing_tests(of_requirements):
    text = "".join(file.read_text() for file in (ROOT / "core" / "test").glob("*.cpp"))
    there = {".".join(names) for names in re.findall(r"\b(?:TYPED_)?TEST(?:_[FP])?\((\w+),\s*(\w+)\)", text)}
    return [(requirement, test) for requirement, tests in of_requirements.items() for test in tests
            if test not in there and not (ROOT / test).is_file()]


def test_each_requirement_has_tests_that_are_there():
    assert len(requirements()) > 25 and all(requirements().values())
    assert missing_tests(requirements()) == []
    assert missing_tests({"planted": ["Snapshot.IsNotThere"]}) == [("planted", "Snapshot.IsNotThere")]


def test_the_assertion_is_the_only_macro():
    macros = [(name, line) for name, lines in sources().items() for line in lines if re.match(r"# *define", line)]
    assert [name for name, _ in macros] == ["core/include/trihedron/core/assert.hpp"]
    assert macros[0][1].startswith("#define TRIHEDRON_ASSERT(")


def test_what_is_planted_is_found():
    planted = {"a.cpp": code_of('while (true) {\nfor (int i = 0; i < 3; ++i) {\ngoto end; // new\nauto p = new int;\nusing F = int (*)(int);\n'
                                'f("throw");')}
    assert found(LOOP, planted) == {("a.cpp", "while (true) {")}
    assert found(POINTER_TO_FUNCTION, planted) == {("a.cpp", "using F = int (*)(int);")}
    assert forbidden(planted) == ["a.cpp: goto", "a.cpp: new"]
