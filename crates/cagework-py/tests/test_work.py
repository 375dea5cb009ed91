"""Long work releases the interpreter lock, and is cancelled by Ctrl-C."""

import _thread
import signal
import subprocess
import sys
import threading

import cagework as cw
import numpy as np
import pytest
from support import box

# A bind of 193 batches of columns, between which cancellation is polled. It takes 90 s on an idle machine, so a signal
# that arrives when it reports its first progress arrives before its end. The shell that runs the tests may have set
# SIGINT to be ignored, which child processes inherit.
SCRIPT = """
import signal, sys
sys.path.insert(0, {tests!r})
signal.signal(signal.SIGINT, signal.default_int_handler)
import cagework as cw, numpy as np
from support import box
cage = cw.Cage(*box(5))
points = np.zeros((1, 3))
said = []
def progress(fraction):
    if not said:
        said.append(fraction)
        print("binding", flush=True)
try:
    cw.bind(points, cage, grid=96, progress=progress)
    print("bound")
except KeyboardInterrupt:
    print("interrupted")
print(cw.bind(points, cage, grid=8)[0].shape)
"""


def test_ctrl_c_cancels_a_bind_and_python_continues():
    script = SCRIPT.format(tests=__file__.rpartition("/")[0])
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "binding\n"
        child.send_signal(signal.SIGINT)
        assert child.stdout.read().split("\n") == ["interrupted", "(1, 1538)", ""]
        assert child.wait() == 0


def test_another_thread_runs_while_a_bind_does():
    # The other thread interrupts the bind. If the bind held the interpreter lock, it would end first.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    cage = cw.Cage(*box(5))
    interrupting = threading.Thread(target=_thread.interrupt_main)

    def progress(_fraction):
        if not interrupting.ident:
            interrupting.start()

    with pytest.raises(KeyboardInterrupt):
        cw.bind(np.zeros((1, 3)), cage, grid=96, progress=progress)
    interrupting.join()


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


def test_progress_that_raises_when_it_is_first_called_cancels_a_fine_grid():
    calls = []

    def progress(fraction):
        calls.append(fraction)
        raise ArithmeticError("enough")

    with pytest.raises(ArithmeticError, match="enough"):
        cw.bind(np.zeros((1, 3)), cw.Cage(*box(5)), grid=160, progress=progress)
    assert len(calls) == 1


class Bar:
    """The part of a bar of tqdm that is used."""

    n, total = 0, None

    def __init__(self):
        self.seen = []

    def update(self, n=1):
        self.seen.append(self.n)

    refresh = update


def test_progress_ends_at_one():
    model = cw.Cage(*box(4))
    fractions = []
    cw.generate_cage(model.vertices, model.triangles, target=30, progress=fractions.append)
    assert fractions[-1] == 1 and fractions == sorted(fractions)


def test_progress_moves_a_bar():
    bar = Bar()
    cw.bind(np.zeros((1, 3)), cw.Cage(*box(4)), grid=64, progress=bar)
    assert (bar.n, bar.total) == (100, 100) and bar.seen == sorted(bar.seen)
    with pytest.raises(TypeError, match="progress: expected a function or a bar of tqdm, got int"):
        cw.bind(np.zeros((1, 3)), cw.Cage(*box()), grid=8, progress=7)
