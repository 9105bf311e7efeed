"""Threads, signals and forks."""

import os
import signal
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pytest

import bvhscope

from . import brute

# A build of minutes.
LONG = """
import signal, sys, threading, time
import numpy as np
import bvhscope
triangles = np.random.default_rng(1).random((100_000, 3, 3), dtype=np.float32)
tree = bvhscope.build(triangles[:20_000], builder="none")
points = np.random.default_rng(2).random((1_000_000, 3), dtype=np.float32)
threading.Timer(0.5, signal.raise_signal, [signal.SIGINT]).start()
try:
    CALL
except KeyboardInterrupt:
    print("interrupted", tree.triangle_count, len(bvhscope.build(triangles[:10]).bounds))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of Windows reach the console")
@pytest.mark.parametrize(
    "call",
    [
        'bvhscope.build(triangles, preset="finest", rounds=4096)',
        'bvhscope.from_file("builtin:terrain:200000", preset="finest", rounds=4096)',
        "tree.closest_hit(points, points)",
        "tree.all_hits(points, points)",
        "tree.closest_point(points)",
        "tree.tests(points, points)",
        "tree.visits(points, points)",
    ],
)
def test_ctrl_c_ends_a_call_and_leaves_tree_and_threads_usable(call):
    program = subprocess.run(
        [sys.executable, "-c", LONG.replace("CALL", call)], capture_output=True, text=True, check=False, timeout=300
    )
    assert (program.stdout, program.returncode) == ("interrupted 20000 19\n", 0), program.stderr


def test_other_threads_run_during_a_call():
    tree = bvhscope.build(brute.soup(1000), builder="none")
    origins, directions = brute.rays(100_000)
    thread = threading.Thread(target=tree.closest_hit, args=(origins, directions), kwargs={"threads": 1})
    # From before the start, which waits for the thread.
    times = [time.perf_counter()]
    thread.start()
    while thread.is_alive():
        times.append(time.perf_counter())
    # A call that keeps the lock is one long gap.
    assert np.diff(times).max() < (times[-1] - times[0]) / 2


def test_threads_share_a_tree_while_it_is_refitted():
    vertices, faces = brute.sphere(3)
    tree = bvhscope.build(vertices, faces)
    directions = brute.rays(500)[1]
    failures = []

    def trace():
        for _ in range(30):
            t = tree.closest_hit([0, 0, 0], directions).t * np.linalg.norm(directions, axis=1)
            # One of the two spheres as a whole.
            if not (np.abs(t - 1) < 0.05).all() and not (np.abs(t - 2) < 0.1).all():
                failures.append(t)

    threads = [threading.Thread(target=trace) for _ in range(3)]
    for thread in threads:
        thread.start()
    for round in range(30):
        tree.refit(vertices * (1 + round % 2))
    for thread in threads:
        thread.join()
    assert not failures


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_has_threads_of_its_own():
    tree = bvhscope.build(brute.soup(1000))
    rays = brute.rays(5000)
    expected = tree.closest_hit(*rays)
    with warnings.catch_warnings():
        # Python 3.12 warns of forks beside threads: hence this test.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        try:
            # Waiting for threads that are not there would not end.
            signal.alarm(120)
            same = np.array_equal(tree.closest_hit(*rays).t, expected.t)
            os._exit(0 if same and len(bvhscope.build(brute.soup(1000)).bounds) == len(tree.bounds) else 1)
        finally:
            os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_a_thread_that_is_no_main_thread_calls_everything():
    results = []
    thread = threading.Thread(target=lambda: results.append(bvhscope.build(brute.soup(5000)).triangle_count))
    thread.start()
    thread.join()
    assert results == [5000]
