"""The reasons of missed_branches.toml stand at conditions that there are, and coverage.py asks for one for each missed outcome.

Run by CTest: python3 -m pytest coverage_test.py.
"""
import importlib.util
import pathlib

# By its path: pytest may already have loaded a package of this name.
SPECIFICATION = importlib.util.spec_from_file_location("coverage_of_core", pathlib.Path(__file__).with_name("coverage.py"))
coverage = importlib.util.module_from_spec(SPECIFICATION)
SPECIFICATION.loader.exec_module(coverage)

KNOWN = {
    ("a.cpp", "true", "x > 0"): "It is not.",
    ("a.cpp", "true", "x > 0 &&"): "Nor here.",
    ("a.cpp", "false", "default:"): "No test yet: others.",
}


def test_each_reason_is_a_sentence_about_a_condition_that_there_is():
    known = coverage.reasons(coverage.REASONS.read_text())
    assert len(known) == coverage.REASONS.read_text().count("\n  [")  # none twice
    for (file, outcome, begins), why in known.items():
        assert begins in (coverage.ROOT / file).read_text()
        assert outcome in ("true", "false")
        assert why.endswith(".")


def test_a_condition_begins_with_a_whole_word():
    assert coverage.condition("  if (a && bcd) {", 12) == "bcd) {"
    assert coverage.condition("  a == b = default;", 17) == "default;"


def test_a_reason_is_of_the_conditions_that_begin_so():
    assert coverage.reason_of(("a.cpp", "true", "x > 0) {"), KNOWN) == ("a.cpp", "true", "x > 0")
    assert coverage.reason_of(("a.cpp", "true", "x > 0 && y) {"), KNOWN) == ("a.cpp", "true", "x > 0 &&")
    assert coverage.reason_of(("a.cpp", "false", "x > 0) {"), KNOWN) is None
    assert coverage.reason_of(("b.cpp", "true", "x > 0) {"), KNOWN) is None
    assert coverage.reason_of(("a.cpp", "true", "y && x > 0) {"), KNOWN) is None


def test_one_reason_may_be_that_of_several_outcomes(capsys):
    missed = {("a.cpp", 3, 7, "true"): "x > 0) {", ("a.cpp", 9, 7, "true"): "x > 0;"}
    assert coverage.print_missed(missed, KNOWN)
    printed = capsys.readouterr().out
    assert printed.count("    It is not.\n") == 2
    assert "a.cpp: no longer missed: false: default:" in printed
    assert "missed: 2; of these without a test yet: 0; without a reason: 0" in printed


def test_an_outcome_without_a_reason_is_named(capsys):
    assert not coverage.print_missed({("a.cpp", 5, 3, "false"): "default:", ("a.cpp", 3, 7, "false"): "x > 0) {"}, KNOWN)
    printed = capsys.readouterr().out
    assert "a.cpp:3:7: never false: x > 0) {\n    without a reason\n" in printed
    assert "missed: 2; of these without a test yet: 1; without a reason: 1" in printed
