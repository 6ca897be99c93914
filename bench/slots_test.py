"""No slot of the on-board application takes more than three times the median one, in instructions.

Run by CTest where there is valgrind: python3 -m pytest slots_test.py.
"""
import os
import pathlib

import pytest

import slots

PROGRAM = str(pathlib.Path(os.environ["TRIHEDRON_BUILD"]) / "trihedron_slots")


@pytest.mark.parametrize("kind", ["slot: a fix every 2.5 to 3 s", "slot: a fix every 1 s", "slot: no star tracker"])
def test_the_work_of_a_fix_is_spread(kind):
    counts = slots.measured(PROGRAM, kind)[kind]
    assert len(counts) == 8 * 24
    assert slots.ratio(counts) <= slots.LARGEST_RATIO


def test_a_clock_that_is_set_back_gives_no_peak():
    kind = "slot: the clock is set back"
    assert slots.ratio(slots.measured(PROGRAM, kind)[kind], slots.measured(PROGRAM, slots.STEADY)[slots.STEADY]) <= slots.LARGEST_RATIO


def test_work_that_is_not_spread_is_found():
    counts = slots.measured(PROGRAM, "not spread: a fix every 3 s")["not spread: a fix every 3 s"]
    assert slots.ratio(counts) > 3 * slots.LARGEST_RATIO
