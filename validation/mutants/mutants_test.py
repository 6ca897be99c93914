"""The edits of core's formulas can still be made, and outcomes are told rightly. The edits themselves are tried by `make mutants`.

Run by CTest: python3 -m pytest mutants_test.py.
"""
import mutants


def test_each_edit_applies_to_the_present_sources():
    for edit in mutants.edits():
        text = (mutants.ROOT / edit.file).read_text()
        assert edit.applied(text) != text


def test_there_are_enough_and_none_twice():
    keys = [edit.key() for edit in mutants.edits()]
    assert len(keys) >= 100
    assert len(set(keys)) == len(keys)
    assert all(edit.wrong for edit in mutants.edits())


def test_only_what_is_caught_or_harmless_is_right(tmp_path):
    right = mutants.Edit("core/src/a.cpp", "a", "b", "a factor")
    harmless = mutants.Edit("core/src/a.cpp", "c", "d", "an order", "of no consequence")
    outcomes = mutants.Outcomes(tmp_path / "outcomes", "these")
    assert not mutants.report([right], outcomes)[1]
    outcomes.add(right, mutants.CAUGHT, "core.A.B")
    outcomes.add(harmless, mutants.SURVIVED, "")
    assert mutants.report([right, harmless], outcomes)[1]
    outcomes.add(right, mutants.SURVIVED, "")
    lines, done = mutants.report([right, harmless], outcomes)
    assert not done and any(line.startswith("NOT CAUGHT") for line in lines)
    outcomes.add(right, mutants.INVALID, "error")
    assert not mutants.report([right, harmless], outcomes)[1]


def test_outcomes_are_kept_for_the_sources_they_were_found_with(tmp_path):
    edit = mutants.Edit("core/src/a.cpp", "a", "b", "a factor")
    mutants.Outcomes(tmp_path / "outcomes", "these").add(edit, mutants.CAUGHT, "core.A.B")
    assert edit.key() in mutants.Outcomes(tmp_path / "outcomes", "these").found
    assert mutants.Outcomes(tmp_path / "outcomes", "others").found == {}
