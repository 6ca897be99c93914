"""Long work: progress, Ctrl-C, other threads; arrays that keep what they show alive."""
import gc
import signal
import subprocess
import sys
import textwrap
import threading
import time
import weakref

import numpy as np
import pytest

import trihedron


def test_progress_is_told_in_the_thread_that_asked(flown):
    told = []
    trihedron.calibrate(flown, progress=lambda fraction: told.append((fraction, threading.get_ident())))
    fractions = [fraction for fraction, _ in told]
    assert fractions == sorted(fractions) and 0 <= fractions[0] and fractions[-1] == 1
    assert {thread for _, thread in told} == {threading.get_ident()}


@pytest.mark.parametrize("long_work", [lambda p, progress: trihedron.calibrate(p, estimator="batch", progress=progress),
                                  lambda p, progress: trihedron.navigate(p, progress=progress),
                                  lambda p, progress: trihedron.observe(p, progress=progress)],
                         ids=["calibrate", "navigate", "observe"])
def test_what_progress_raises_ends_the_work(long_work, flown):
    class Enough(Exception):
        pass

    def stop(fraction):
        raise Enough

    with pytest.raises(Enough):
        long_work(flown, stop)


def test_other_threads_run_meanwhile(flown):
    counted = []

    def count():
        while not done.is_set():
            counted.append(time.monotonic())
            time.sleep(0.001)

    done = threading.Event()
    thread = threading.Thread(target=count)
    thread.start()
    begin = time.monotonic()
    trihedron.calibrate(flown, estimator="batch")
    took = time.monotonic() - begin
    done.set()
    thread.join()
    gaps = np.diff([begin, *counted])
    assert max(gaps) < max(0.5, took / 2)  # with the lock held it would wait for all of it
    assert sum(begin < at < begin + took for at in counted) > 20  # and would not count once meanwhile


def test_two_threads_get_what_one_gets(flown, calibrated):
    texts = []
    threads = [threading.Thread(target=lambda: texts.append(trihedron.calibrate(flown).to_json())) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert texts == [calibrated.to_json()] * 2


LONG_CALLS = ['trihedron.calibrate(p, estimator="batch")', "trihedron.navigate(p)", "trihedron.observe(p)",
              'trihedron.simulate({"scenario": {"duration": "48h"}})']


def test_ctrl_c_ends_it_within_a_second():
    """Each call would take seconds, of a pass of nine hours, and would be made again. It begins before the signal, which is sent when it says so."""
    script = textwrap.dedent(f"""
        import trihedron
        p = trihedron.simulate({{"scenario": {{"duration": "9h"}}}})
        for call in [{", ".join(f"lambda: {call}" for call in LONG_CALLS)}]:
            print("begin", flush=True)
            try:
                while True:
                    call()
            except KeyboardInterrupt:
                print("interrupted", flush=True)
    """)
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    try:
        for call in LONG_CALLS:
            assert process.stdout.readline() == "begin\n", call
            time.sleep(0.3)
            begin = time.monotonic()
            process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "interrupted\n", call
            assert time.monotonic() - begin < 1, call
        assert process.wait(timeout=10) == 0
    finally:
        process.kill()
        process.wait()


def test_arrays_are_views_that_keep_their_owner_alive(flown):
    result = trihedron.calibrate(flown)
    covariance, q_x = result.covariance, result.attitude.q_x.values
    again = result.covariance
    assert covariance.__array_interface__["data"][0] == again.__array_interface__["data"][0]  # the same memory
    assert not covariance.flags.writeable and not q_x.flags.owndata
    with pytest.raises(ValueError):
        covariance[0, 0] = 0
    before = covariance.copy(), q_x.copy()
    reference = weakref.ref(result)
    del result, again
    gc.collect()
    assert reference() is None
    rubbish = [np.full_like(before[0], np.nan) for _ in range(100)]
    np.testing.assert_array_equal(covariance, before[0])
    np.testing.assert_array_equal(q_x, before[1])
    del rubbish


def test_an_event_of_a_generator_may_be_kept(flown):
    events = [event for _, event in zip(range(50), flown.events())]
    gc.collect()
    assert all(np.isfinite(np.asarray(event[1])).all() for event in events)
