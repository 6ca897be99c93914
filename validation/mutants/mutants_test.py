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
    others = mutants.Outcomes(tmp_path / "outcomes", "others")
    assert others.found == {} and others.failed_before == {edit.key(): "core.A.B"}


SOURCE = '''namespace a {
constexpr double kOutside = 2;
struct S {
  int member_{3};
  // a } brace in a comment, and one in a text: "}"
  [[nodiscard]] int f() const { return member_ + 1; }
  explicit S(int x) : member_(x) {}
};
template <class T>
auto g(T x) -> typename T::Type {
  const char* text = "{";
  for (int i = 0; i < 3; ++i) { x += 2; }
  return x;
}
}  // namespace a
'''


def test_each_function_with_edits_stands_there_once_for_each():
    inside = mutants.Edit("a.cpp", "member_ + 1", "member_ - 1", "a sign")
    loop = mutants.Edit("a.cpp", "i < 3", "i < 2", "a bound")
    other = mutants.Edit("a.cpp", "x += 2", "x += 3", "a term")
    outside = mutants.Edit("a.cpp", "kOutside = 2", "kOutside = 3", "a constant")
    text, left = mutants.with_all(SOURCE, [(1, inside), (2, loop), (3, outside), (4, other)])
    assert left == [3]
    assert "{ if (trihedron_is_mutant(1)) { return member_ - 1; } else { return member_ + 1; } }" in text
    assert text.count("if (trihedron_is_mutant(2))") == text.count("if (trihedron_is_mutant(4))") == 1
    assert text.count("for (int i = 0; i < 3; ++i) { x += 2; }") == 1
    assert text.count("for (int i = 0; i < 2; ++i) { x += 2; }") == text.count("for (int i = 0; i < 3; ++i) { x += 3; }") == 1


def test_the_table_counts_and_names_what_is_not_caught(tmp_path):
    right = mutants.Edit("core/src/a.cpp", "a", "b", "a factor")
    harmless = mutants.Edit("core/src/a.cpp", "c", "d", "an order", "of no consequence")
    outcomes = mutants.Outcomes(tmp_path / "outcomes", "these")
    outcomes.add(right, mutants.CAUGHT, "core.A.B")
    outcomes.add(harmless, mutants.SURVIVED, "")
    document = tmp_path / "document.md"
    document.write_text("before\n<!-- mutants -->\nold\n<!-- end -->\nafter\n")
    mutants.place(document, mutants.table([right, harmless], outcomes))
    text = document.read_text()
    assert "| `core/src/a.cpp` | 2 | 1 | 1 |" in text and "an order: of no consequence" in text
    assert text.startswith("before") and text.endswith("after\n") and "old" not in text
