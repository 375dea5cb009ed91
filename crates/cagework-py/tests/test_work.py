"""Long work releases the interpreter lock, and is cancelled by Ctrl-C."""

import signal
import subprocess
import sys
import threading
import time

import cagework as cw
import numpy as np
import pytest
from support import box

# A bind of 193 batches of columns, between which cancellation is polled.
SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
import cagework as cw, numpy as np
from support import box
cage = cw.Cage(*box(5))
points = np.zeros((1, 3))
cw.bind(points, cage, grid=8)
print("binding", flush=True)
try:
    cw.bind(points, cage, grid=96)
    print("bound")
except KeyboardInterrupt:
    print("interrupted")
print(cw.bind(points, cage, grid=8)[0].shape)
"""
# Longest time from Ctrl-C to the end of the process, seconds. A batch takes 0.1 s and the whole bind 90 s on an idle
# machine.
TIMEOUT = 20.0


def test_ctrl_c_cancels_a_bind_and_python_continues():
    script = SCRIPT.format(tests=__file__.rpartition("/")[0])
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "binding\n"
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        sent = time.monotonic()
        assert child.stdout.read().split("\n") == ["interrupted", "(1, 1538)", ""]
        assert child.wait() == 0 and time.monotonic() - sent < TIMEOUT


def test_another_thread_runs_while_a_bind_does():
    ticks, ended = [], threading.Event()

    def count():
        while not ended.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    cage = cw.Cage(*box(3))
    counting = threading.Thread(target=count)
    counting.start()
    began = time.perf_counter()
    cw.bind(np.zeros((1, 3)), cage, grid=64)
    took = time.perf_counter() - began
    ended.set()
    counting.join()
    during = [began, *(t for t in ticks if began < t < began + took), began + took]
    # If the bind held the interpreter lock, the other thread could not count while the bind runs.
    assert max(np.diff(during)) < took / 2 and len(during) > 10


def test_progress_reports_fractions_and_cancels_by_raising():
    class StopError(Exception):
        pass

    fractions = []

    def progress(fraction):
        fractions.append(fraction)
        if len(fractions) == 3:
            raise StopError

    with pytest.raises(StopError):
        cw.bind(np.zeros((1, 3)), cw.Cage(*box(5)), grid=96, progress=progress)
    assert fractions == sorted(fractions) and 0 <= fractions[0] and fractions[-1] < 1
