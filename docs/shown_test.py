"""What the documents show is so: commands of the pages print what stands there, commands elsewhere are understood, targets and findings exist.

Run by CTest with TRIHEDRON_BUILD naming the build directory. `make shown` writes into the pages what their commands print.
"""
import os
import pathlib
import re
import subprocess

import pytest

import links
import shown

ROOT = shown.ROOT
BUILD = pathlib.Path(os.environ.get("TRIHEDRON_BUILD", ROOT / "build"))
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("**/*.md"))]


@pytest.mark.parametrize("page", shown.pages(), ids=lambda page: page.stem)
def test_commands_of_a_page_print_what_it_shows(page, tmp_path):
    found = shown.complaints(shown.run(page.read_text(), BUILD, tmp_path))
    assert not found, "\n\n".join(found) + "\n\nmake shown writes what they print into the page"


def test_pages_are_found():
    assert len(shown.pages()) >= 12


PAGE = """Text.

```{code-block} toml
:caption: a.toml
x = 1
```

```console
$ cat a.toml
x = 1
$ printf '%s\\n' one \\
    2.50
one
2.51
$ false
$ echo $?
1
```
"""


def test_a_page_is_run_in_its_order_in_one_shell(tmp_path):
    commands = shown.run(PAGE, BUILD, tmp_path)
    assert [its.printed for its in commands] == [["x = 1"], ["one", "2.50"], [], ["1"]]
    assert shown.complaints(commands) == []
    assert shown.rewritten(PAGE, commands) == PAGE.replace("2.51", "2.50")


@pytest.mark.parametrize("right, wrong", [("x = 1", "x = 2"), ("2.51", "2.52"), ("one\n", ""), ("one\n", "one\none\n"), ("$ echo $?\n1\n", "")])
def test_what_a_page_says_wrong_is_found(right, wrong, tmp_path):
    text = PAGE.replace(f"\n{right}", f"\n{wrong}", 1) if right == "one\n" else PAGE[:PAGE.index("```console")] + PAGE[PAGE.index("```console"):].replace(right, wrong)
    assert len(shown.complaints(shown.run(text, BUILD, tmp_path))) == 1


@pytest.mark.parametrize("a, b, same", [
    ("1.04″ of 9", "1.05″ of 9", True), ("1.04″", "1.06″", False), ("of 9", "of 8", False), ("1.2e-08", "1.3e-08", True), ("1.2e-08", "1.2e-07", False),
    ("−0.5", "-0.5", True), ("0.123456789", "0.123456799", True), ("0.123456789", "0.123457789", False), ("2.0 h", "2.0 s", False), ("2009-05-20", "2009-05-21", False)])
def test_a_number_may_differ_by_one_in_its_last_digit_or_by_a_millionth(a, b, same):
    assert shown.agree(a, b) == same


def commands_elsewhere():
    """Lines with our program in code blocks that are not run with their output, (page, line), without comments and with one of alternatives."""
    for path in DOCUMENTS:
        texts = ["\n".join(f"    {line}" if kind == "sh" else line for line in lines) for kind, lines in shown.blocks(path.read_text())
                 if kind in ("prose", "sh")]
        joined = re.sub(r"\|\n\s+", "| ", "\n".join(texts))
        for line in re.findall(r"^(?: {4}|\$ )((?:build/)?trihedron [^\n]*|[^\n]*\| trihedron [^\n]*)", joined, re.MULTILINE):
            if "[options]" not in line:
                line = re.sub(r"\s+# .*", "", line).replace("build/trihedron", "trihedron")
                yield path.name, re.sub(r"(?<=[\w.])\|[\w.|-]+", "", line).replace("…", "").replace("[", "").replace("]", "")


def test_commands_that_are_shown_without_their_output_are_understood(tmp_path):
    """In a directory without any file: an input that is not there is refused (3), a command that is not understood is wrong usage (2)."""
    lines = [(page, line) for page, line in commands_elsewhere() if not re.match("trihedron demo", line)]  # demo_test.py runs that
    assert len(lines) > 60
    (tmp_path / "bin").mkdir()
    wrapper = tmp_path / "bin" / "trihedron"
    wrapper.write_text(f'#!/bin/sh\n"{BUILD}/trihedron" "$@"\nstatus=$?\necho "$status $*" >>"{tmp_path}/ended"\nexit $status\n')
    wrapper.chmod(0o755)
    (tmp_path / "work").mkdir()
    environment = {**os.environ, "PATH": f"{wrapper.parent}:{os.environ['PATH']}"}
    subprocess.run(["bash", "-c", "\n".join(line for _, line in lines)], cwd=tmp_path / "work", env=environment, stdin=subprocess.DEVNULL,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=120, check=False)
    ended = (tmp_path / "ended").read_text().splitlines()
    assert len(ended) >= len(lines)
    assert [its for its in ended if its[0] not in "013"] == []


def test_targets_that_the_documents_name_exist():
    makefile = (ROOT / "Makefile").read_text()
    targets = set(re.findall(r"^([\w-]+):(?!=)", makefile, re.MULTILINE))
    named = {(path.name, target) for path in DOCUMENTS for line in re.findall(r"(?:`|^ {4}|^\$ )make ([a-z][a-z -]*)", path.read_text(), re.MULTILINE)
             for target in line.split()}
    assert len(named) > 40
    assert sorted(its for its in named if its[1] not in targets) == []


def test_documents_that_documents_name_exist_and_are_in_the_navigation():
    named = {path for document in DOCUMENTS for path in re.findall(r"`(docs/[\w/.-]+\.md)`", document.read_text())}
    assert len(named) > 40
    assert sorted(path for path in named if not (ROOT / path).exists()) == []
    listed = {(index.parent / entry).resolve() for index in DOCUMENTS for tree in re.findall(r"```\{toctree\}(.*?)```", index.read_text(), re.DOTALL)
              for entry in re.findall(r"^[\w/.*-]+$", tree, re.MULTILINE)}
    pages = {path.with_suffix("") for path in DOCUMENTS[2:]} - {ROOT / "docs" / "index"}
    assert sorted(str(page) for page in pages - listed if page.parent / "*" not in listed) == []


def test_page_of_findings_has_those_of_the_program():
    header = (ROOT / "records/include/trihedron/records/finding.hpp").read_text()
    words = {"DoNotUse": "do not use", "Warning": "warning", "Note": "note"}
    made = {(name, words[severity]) for name, severity in re.findall(r'\{FindingCode::\w+, "([a-z-]+)", FindingSeverity::k(\w+)\}', header)}
    told = re.findall(r"^\| `([a-z-]+)` \| ([a-z ]+) \|", (ROOT / "docs/reference/findings.md").read_text(), re.MULTILINE)
    assert len(told) == len(made) and set(told) == made


def test_links_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html#there">b</a><a href="#here">a</a><a href="https://example.org/x">x</a>')
    (tmp_path / "b.html").write_text('<a name="there" href="a.html#gone"></a><img src="none.png">')
    assert sorted(link for _, link in links.broken_links(tmp_path)) == ["a.html#gone", "none.png"]
