"""Work on several cores: the same results in the same order, errors, processes that die."""

import multiprocessing
import os
import signal
import sys

import numpy as np
import pytest

from skidyn._cores import alone, aside, cores, each
from skidyn._progress import listening

LINUX = sys.platform == "linux"
several = pytest.mark.skipif(not LINUX, reason="processes are forked on Linux only")


@pytest.mark.parametrize("n_jobs", [None, 1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 5, 10_000])
def test_results_come_in_the_order_of_the_items(n_jobs, count):
    with cores(n_jobs):
        assert each(lambda k: 2 * k, range(count)) == [2 * k for k in range(count)]


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_the_share_that_is_done_grows_to_all_of_it(n_jobs):
    told = []
    with cores(n_jobs), listening(lambda text, share: told.append((text, share))):
        each(lambda k: k, range(50), "Counting")
    shares = [share for _, share in told]
    assert {text for text, _ in told} == {"Counting"}
    assert shares == sorted(shares) and shares[-1] == 1.0


@several
def test_arrays_come_back_to_the_last_bit_and_may_be_changed():
    values = np.random.default_rng(0).normal(size=(7, 1000, 3))
    with cores(3):
        roots = each(lambda x: {"root": np.sqrt(np.abs(x)), "rows": len(x)}, values)
    for x, found in zip(values, roots, strict=True):
        assert found["rows"] == 1000
        assert np.array_equal(found["root"], np.sqrt(np.abs(x)))
        found["root"] += 1.0


@several
def test_several_processes_work():
    with cores(2):
        # each waits for the other
        first, second = os.pipe(), os.pipe()

        def meet(k):
            mine, other = (first, second) if k else (second, first)
            os.write(other[1], b"x")
            os.read(mine[0], 1)
            return os.getpid()

        assert len(set(each(meet, range(2)))) == 2
        assert not alone()
    assert alone()


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_errors_are_raised_where_the_results_are_wanted(n_jobs):
    def fails(k):
        if k == 3:
            raise ValueError("no square of 3")
        return k

    with cores(n_jobs), pytest.raises(ValueError, match="no square of 3"):
        each(fails, range(5))


@several
def test_what_a_process_that_was_killed_had_is_done_again():
    parent = os.getpid()

    def dies(k):
        if os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return k

    with cores(2):
        assert each(dies, range(20)) == list(range(20))
        with aside(lambda: dies(1)) as found:
            assert found() == 1


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_something_is_computed_beside_the_block(n_jobs):
    with cores(n_jobs), aside(lambda: None) as nothing, aside(lambda: 42) as answer:
        assert answer() == 42
        assert answer() == 42
        assert nothing() is None


@pytest.mark.parametrize("n_jobs", [1, pytest.param(2, marks=several)])
def test_an_error_beside_the_block_waits_for_the_question(n_jobs):
    def fails():
        raise KeyError("lost")

    with cores(n_jobs), aside(fails) as found, pytest.raises(KeyError, match="lost"):
        found()


@several
def test_nothing_runs_on_after_an_error_in_the_block():
    read, write = os.pipe()

    def waits():
        os.write(write, b"%d" % os.getpid())
        signal.pause()

    with cores(2), pytest.raises(ZeroDivisionError), aside(waits):
        pid = int(os.read(read, 10))
        raise ZeroDivisionError
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@several
def test_a_system_that_gives_no_further_process_is_enough(monkeypatch):
    def refuses():
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(os, "fork", refuses)
    with cores(3), aside(lambda: 42) as answer:
        assert each(lambda k: 2 * k, range(5)) == [0, 2, 4, 6, 8]
        assert answer() == 42


def test_no_processes_at_all_is_refused():
    with pytest.raises(ValueError, match="n_jobs=0"), cores(0):
        pass


@pytest.mark.parametrize("short", [False, True])
def test_no_process_is_left_behind(short):
    before = set(multiprocessing.active_children())  # of other libraries

    with cores(2):
        assert each(lambda k: np.full(1000, k).sum(), range(8), short=short) == [
            1000 * k for k in range(8)
        ]

    assert set(multiprocessing.active_children()) <= before
