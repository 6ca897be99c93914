"""A short flight on the emulated Cortex-M7 gives the desktop's bits and keeps the limits; what the compiler's call graph shows.

Run by CTest: python3 -m pytest fly_test.py, with TRIHEDRON_BUILD naming the build directory.
"""
import os
import pathlib
import subprocess

import numpy
import pytest

import fly
from call_graph import CallGraph

BUILD = pathlib.Path(os.environ["TRIHEDRON_BUILD"])

needs_target = pytest.mark.skipif(bool(fly.CORTEX_M7.missing()),
                                  reason=f"{fly.CORTEX_M7.missing()} missing: cmake/setup.sh flight installs cross compiler and emulator")


@pytest.fixture(scope="session")
def desktop_and_target(tmp_path_factory):
    scenario = tmp_path_factory.mktemp("flight") / "short.toml"
    scenario.write_text('[scenario]\nduration = "15min"\n')
    feed = fly.feed_of(BUILD, scenario, "short")
    return fly.flown(fly.DESKTOP, BUILD, feed), fly.flown(fly.CORTEX_M7, BUILD, feed)


@pytest.fixture(scope="session")
def graph(desktop_and_target):
    return fly.call_graph(BUILD)


@pytest.mark.long
@needs_target
def test_cortex_m7_gives_the_bits_of_the_desktop(desktop_and_target):
    desktop, target = desktop_and_target
    assert len(target.records) > 7000
    assert (target.records["fix"] > fly.FIX_PENDING).sum() > 290
    assert target.same_bits(desktop)


@pytest.mark.long
@needs_target
def test_a_planted_difference_is_found(desktop_and_target):
    desktop, target = desktop_and_target
    changed = fly.Result(fly.directory(fly.CORTEX_M7, BUILD) / "short.result")
    changed.records["C_in_c"][5000, 1, 1] += 1e-15
    assert not changed.same_bits(desktop)
    changed = fly.Result(fly.directory(fly.CORTEX_M7, BUILD) / "short.result")
    changed.calibration[100] += numpy.uint64(1)
    assert not changed.same_bits(desktop)


@pytest.mark.long
@needs_target
def test_a_feed_that_breaks_off_is_refused(desktop_and_target, tmp_path):
    whole = (BUILD / "flight" / "short.feed").read_bytes()
    program = fly.directory(fly.DESKTOP, BUILD) / "fly"
    for feed in (b"", whole[:4], whole[:100], whole[:-64], b"x" + whole[1:]):
        (tmp_path / "feed").write_bytes(feed)
        assert subprocess.run([program, tmp_path / "feed", tmp_path / "result"]).returncode == 3
    assert subprocess.run([program, tmp_path / "none", tmp_path / "result"]).returncode == 3
    assert subprocess.run([program, BUILD / "flight" / "short.feed", tmp_path / "none" / "result"]).returncode == 4
    assert subprocess.run([program]).returncode == 2


@pytest.mark.long
@needs_target
def test_what_is_no_pass_gets_no_feed(tmp_path):
    assert subprocess.run([BUILD / "trihedron_feed", tmp_path, tmp_path / "feed"], capture_output=True).returncode == 3
    assert subprocess.run([BUILD / "trihedron_feed"], capture_output=True).returncode == 2


@pytest.mark.long
@needs_target
def test_limits_of_memory_and_time_are_kept(desktop_and_target):
    target = desktop_and_target[1]
    assert target.measured == 1
    limits = fly.limits(target, BUILD)
    assert [limit for limit in limits if not limit.kept()] == []
    assert all(limit.value > 0 for limit in limits)


@pytest.mark.long
@needs_target
def test_nothing_is_recursive_and_no_frame_depends_on_its_arguments(graph):
    roots = graph.find(fly.ROOTS)
    assert len(roots) == 5
    assert graph.circle(roots) == []
    assert graph.unbounded & graph.reached(roots) == set()


@pytest.mark.long
@needs_target
def test_nothing_of_the_heap_is_called(graph):
    assert set(graph.foreign(graph.find(fly.ROOTS))) <= fly.LIBRARY | {fly.INDIRECT}


@pytest.mark.long
@needs_target
def test_the_painted_stack_is_within_that_of_the_call_graph(desktop_and_target, graph):
    deepest = max(graph.deepest(root)[0] for root in graph.find(fly.ROOTS))
    painted = desktop_and_target[1].stack_bytes
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
