"""A short flight on the emulated Cortex-M7 gives the desktop's bits and keeps the limits; what the compiler's call graph shows.

Run by CTest: python3 -m pytest fly_test.py, with TRIHEDRON_BUILD naming the build directory.
"""
import copy
import os
import pathlib
import subprocess

import numpy
import pytest

import fly
from call_graph import CallGraph

BUILD = pathlib.Path(os.environ["TRIHEDRON_BUILD"])

# Compiled in units of a dozen files: in half the time.
IN_UNITS = BUILD / "in_units"
UNITS = ("-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=12")

needs_target = pytest.mark.skipif(bool(fly.CORTEX_M7.missing()),
                                  reason=f"{fly.CORTEX_M7.missing()} missing: cmake/setup.sh flight installs cross compiler and emulator")


# A quarter of an hour in which the calibration is adopted: by an orbit and a requirement of minutes.
SOON = ("--window", "5min", "--required-interval", "5min")


@pytest.fixture(scope="session")
def replay(tmp_path_factory):
    scenario = tmp_path_factory.mktemp("flight") / "short.toml"
    scenario.write_text('[scenario]\nduration = "15min"\n')
    return fly.replayed(BUILD, scenario, "short", *SOON)


@pytest.fixture(scope="session")
def here(replay):
    return fly.flown_here(BUILD, replay[0])


@pytest.fixture(scope="session")
def target(replay):
    return fly.flown(fly.CORTEX_M7, IN_UNITS, replay[0], *UNITS)


@pytest.fixture(scope="session")
def graph(target):
    return fly.call_graph(IN_UNITS)


@pytest.mark.long
def test_the_program_that_is_flown_gives_the_attitude_of_replay(replay, here):
    assert len(replay[1]) > 7000
    assert here.rows() == replay[1]
    assert here.fixes_used() > 290
    assert here.end["housekeeping"]["adoptions"] == 1
    assert here.is_restored()


@pytest.mark.long
@needs_target
def test_cortex_m7_gives_the_bits_of_this_machine(here, target):
    assert target.same_bits(here)
    assert target.attitude_difference_rad(here) == 0


@pytest.mark.long
@needs_target
def test_a_planted_difference_is_found(here, target):
    for column, index in (("q_in_c", (5000, 1)), ("covariance", (5000, 2, 1))):
        changed = copy.deepcopy(target)
        changed.outcomes[column][index] = numpy.nextafter(changed.outcomes[column][index], 1)
        assert not changed.same_bits(here)
    changed = copy.deepcopy(target)
    for record in ("housekeeping", "restored"):
        changed.end[record]["predicted_error_rad"] *= 1 + 1e-15
    assert not changed.same_bits(here)


@pytest.mark.long
def test_records_that_break_off_are_refused(replay, tmp_path):
    records = replay[0].read_bytes()
    program = BUILD / "trihedron_fly"
    for damaged in (b"", records[:4], records[:100], records[:-1], records[8:], records[:8] + bytes(len(records) - 8), records + b"\x09" + bytes(7)):
        (tmp_path / "records").write_bytes(damaged)
        assert subprocess.run([program, tmp_path / "records", tmp_path / "result"]).returncode == 3
    assert subprocess.run([program, tmp_path / "none", tmp_path / "result"]).returncode == 3
    assert subprocess.run([program, replay[0], tmp_path / "none" / "result"]).returncode == 4
    assert subprocess.run([program]).returncode == 2


def test_records_of_another_byte_order(tmp_path):
    parameters = numpy.zeros(1, numpy.dtype(fly.tables.layout("parameters")))
    parameters["gyros"], parameters["gate_nis"] = 2, 1.5
    sample = numpy.array([1, 2**40, 3], "<u8")
    swapped = fly.in_byte_order(bytes(8) + parameters.tobytes() + sample.tobytes(), ">")
    assert len(swapped) == 8 + parameters.nbytes + sample.nbytes
    its = numpy.frombuffer(swapped, parameters.dtype.newbyteorder(">"), 1, 8)
    assert its["gyros"] == 2 and its["gate_nis"] == 1.5
    assert (numpy.frombuffer(swapped, ">u8", offset=8 + parameters.nbytes) == sample).all()


@pytest.mark.long
@needs_target
def test_limits_of_memory_and_time_are_kept(target):
    assert target.end["measured"] == 1
    limits = fly.limits(target, IN_UNITS)
    assert [limit for limit in limits if not limit.kept()] == []
    assert all(limit.value > 0 for limit in limits)


@pytest.mark.long
@needs_target
def test_nothing_is_recursive_and_no_frame_depends_on_its_arguments(graph):
    roots = graph.find(fly.ROOTS)
    assert len(roots) == 9
    assert graph.circle(roots) == []
    assert graph.unbounded & graph.reached(roots) == set()


@pytest.mark.long
@needs_target
def test_nothing_of_the_heap_is_called(graph):
    for root in graph.find(fly.ROOTS):
        allowed = fly.LIBRARY | {fly.INDIRECT} | (fly.FREE_OF_NOTHING if root == "trihedron_load_parameters" else set())
        assert set(graph.foreign([root])) <= allowed, root


@pytest.mark.long
@needs_target
def test_the_painted_stack_is_within_that_of_the_call_graph(target, graph):
    deepest = max(graph.deepest(root)[0] for root in graph.find(fly.ROOTS))
    painted = target.end["stack_bytes"]
    assert 0.3 * deepest < painted < deepest + 256  # frames of the C library


def test_a_circle_of_calls_is_found(tmp_path):
    node = 'node: {{ title: "{0}" label: "{0}()\\n{0}.cpp:1:1\\n{1} bytes (static)" }}\n'
    edge = 'edge: {{ sourcename: "{0}" targetname: "{1}" label: "x" }}\n'
    file = tmp_path / "a.ci"
    file.write_text(node.format("f", 8) + node.format("g", 16) + node.format("h", 100) + edge.format("f", "g") + edge.format("g", "malloc"))
    small = CallGraph([file])
    assert small.circle(["f"]) == []
    assert small.deepest("f") == (24, ("f", "g", "malloc"))
    assert small.foreign(["f"]) == ["malloc"]
    file.write_text(file.read_text() + edge.format("g", "f"))
    assert small.circle(["f"]) == [] and CallGraph([file]).circle(["f"]) == ["f", "g"]
