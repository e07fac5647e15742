# SPDX-License-Identifier: BSD-3-Clause
"""Independent tasks on several cores, with exactly the same results as on one.

A forked process shares all data computed so far without a copy, and starts within milliseconds.
Arrays of its results are returned in memory that both processes have, the rest through a pipe.
Tasks are distributed one by one, so that no process waits while another has several left. Every
task is computed by the same instructions in any process. Forking is safe on Linux while linear
algebra is held to one thread, as :func:`skidyn.diagnosis.diagnose` does; elsewhere all work is done
in one process.
"""

from __future__ import annotations

import gc
import mmap
import os
import pickle
import signal
import struct
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import accumulate
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from skidyn._progress import listening, tell, track

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import ForkProcess

Item = TypeVar("Item")
Result = TypeVar("Result")

_CORES: ContextVar[int] = ContextVar("skidyn_cores", default=1)
#: Processes of :func:`aside` whose results may not be there yet.
_ASIDE: ContextVar[tuple[_Child[Any], ...]] = ContextVar("skidyn_aside", default=())
#: Processes that are ended, but whose memory the system may still be freeing.
_ENDED: ContextVar[list[ForkProcess]] = ContextVar("skidyn_ended")
#: Most processes: more would not save the time that starting them takes.
MOST_PROCESSES = 8
#: Approximate time that starting and ending a process takes, s, with the memory that it copies.
STARTING = 0.03
#: Number of task numbers that fit into a pipe; processes read them one after another.
MOST_PIECES = 4096
_NUMBER = struct.Struct("=I")
#: Bytes at multiples of which arrays begin in memory.
_ALIGNED = 64


@contextmanager
def cores(n_jobs: int | None) -> Iterator[None]:
    """Use several processes for :func:`each` and :func:`aside` inside the ``with`` block.

    Processes are counted as joblib does: None is 1 unless set by a ``joblib.parallel_config``, -1
    all cores; 1 inside a process of joblib. No more than 8 are used. A ValueError is raised for 0.

    >>> with cores(2):
    ...     each(lambda x: x**2, range(4))
    [0, 1, 4, 9]
    """
    from joblib import effective_n_jobs

    if n_jobs == 0:
        raise ValueError("n_jobs=0; expected the number of processes, -1 for all cores, or None")
    token = _CORES.set(
        min(effective_n_jobs(n_jobs), MOST_PROCESSES) if sys.platform == "linux" else 1
    )
    ended = _ENDED.set([])
    try:
        yield
    finally:
        _CORES.reset(token)
        for process in _ENDED.get():
            process.join()
        _ENDED.reset(ended)


def alone() -> bool:
    """Whether all work is done in this process."""
    return _CORES.get() < 2


def each(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    text: str = "",
    *,
    short: bool = False,
) -> list[Result]:
    """Results of a function for every item, in their order; its exceptions are raised.

    A result is pickled if another process computed it, and side effects there are lost; items need
    not be picklable. ``text`` describes the task for progress reports. A process of :func:`aside`
    takes one of the cores until it has its result. With ``short`` items of a few milliseconds or
    less, processes are started only while the items left are expected to take twice as long as
    starting one, by the time of those so far.
    """
    items = list(items)
    size = -(-len(items) // MOST_PIECES)
    pieces = [range(k, min(k + size, len(items))) for k in range(0, len(items), max(1, size))]
    count = _CORES.get()
    if min(count, len(pieces)) < 2:
        return [function(item) for item in (track(items, text) if text else items)]
    left, filled = os.pipe()
    os.write(filled, b"".join(_NUMBER.pack(k) for k in range(len(pieces))))
    os.close(filled)  # a process that finds the pipe empty is done

    children: list[_Child[dict[int, Result]]] = []
    begin = time.perf_counter()

    def start(begun: int) -> None:
        """Start a process for every free core; one of :func:`aside` may end meanwhile."""
        spent = time.perf_counter() - begin
        if short and (not begun or spent / begun * (len(pieces) - begun) <= 2 * STARTING):
            return
        free = count - sum(child.busy for child in _ASIDE.get())
        while 1 + len(children) < min(free, len(pieces)) and (child := _started(work)):
            children.append(child)

    def work(before: Callable[[int], None] = lambda _: None) -> dict[int, Result]:
        done: dict[int, Result] = {}
        while number := os.read(left, _NUMBER.size):
            (k,) = _NUMBER.unpack(number)
            before(k)
            if text:
                tell(text, k / len(pieces))
            done.update((i, function(items[i])) for i in pieces[k])
        return done

    token = _CORES.set(1)
    try:
        done = work(start)
        for child in children:
            done |= child.result() or {}
        if text:
            tell(text, 1.0)
        # the tasks of a killed process, for example due to its memory, are lost
        return [done[k] if k in done else function(item) for k, item in enumerate(items)]
    finally:
        _CORES.reset(token)
        os.close(left)
        for child in children:
            child.end()


@contextmanager
def aside(function: Callable[[], Result]) -> Iterator[Callable[[], Result]]:
    """Compute a function without arguments in parallel with the ``with`` block.

    The block gets a function that waits for the result and returns it, or raises its exception. The
    result must be picklable, and side effects are lost. With one core it is computed at once,
    before the block, which gets its exception as well only when it asks for the result.
    """
    child = None if alone() else _started(lambda: _Boxed(function()))
    if child is None:
        yield _outcome_of(function)
        return
    token = _ASIDE.set((*_ASIDE.get(), child))
    try:
        kept: list[Result] = []

        def result() -> Result:
            if not kept:
                box = child.result()
                kept.append(function() if box is None else box.value)
            return kept[0]

        yield result
    finally:
        _ASIDE.reset(token)
        child.end()


def _outcome_of(function: Callable[[], Result]) -> Callable[[], Result]:
    """Call a function, and return one that returns its result or raises its exception."""
    try:
        value = function()
    except Exception as error:
        failure = error

        def fails() -> Result:
            raise failure

        return fails
    return lambda: value


class _Boxed(Generic[Result]):
    """A result that may be None."""

    def __init__(self, value: Result) -> None:
        self.value = value


class _Child(Generic[Result]):
    """A forked process for one computation."""

    def __init__(self, function: Callable[[], Result]) -> None:
        from multiprocessing import get_context

        fork = get_context("fork")
        self._pipe, into = fork.Pipe(duplex=False)
        self._memory = os.memfd_create("skidyn")
        answer = function, into, self._memory
        self._process = fork.Process(target=_answer, args=answer, daemon=True)
        try:
            with warnings.catch_warnings():
                # Python 3.12 warns of any other thread, including idle ones of linear algebra.
                warnings.simplefilter("ignore", DeprecationWarning)
                self._process.start()
        except OSError:
            self._pipe.close()
            os.close(self._memory)
            raise
        finally:
            into.close()

    @property
    def busy(self) -> bool:
        """Whether its result is not there yet."""
        return not self._pipe.poll()

    def result(self) -> Result | None:
        """The result; None if the process ended without one."""
        try:
            pickled, sizes = self._pipe.recv()
        except (EOFError, OSError):  # before or within an answer
            return None
        fine, value = pickle.loads(pickled, buffers=_mapped(self._memory, sizes))
        if not fine:
            raise value
        return value  # type: ignore[no-any-return]

    def end(self) -> None:
        """End the process if it still runs, without waiting until its memory is free."""
        self._pipe.close()
        os.close(self._memory)
        self._process.kill()
        _ENDED.get().append(self._process)


def _answer(function: Callable[[], Result], into: Connection, memory: int) -> None:
    """Main function of a child process: compute, and send the result or the exception."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.disable()  # a collection would copy every page with an object
    _CORES.set(1)
    with listening(None):
        try:
            outcome: tuple[bool, Any] = True, function()
        except Exception as error:
            outcome = False, error
    arrays: list[pickle.PickleBuffer] = []
    pickled = pickle.dumps(outcome, protocol=5, buffer_callback=arrays.append)
    raw = [array.raw() for array in arrays]
    sizes = [array.nbytes for array in raw]
    with open(memory, "wb", closefd=False) as file:
        for array, start in zip(raw, accumulate(map(_aligned, sizes), initial=0), strict=False):
            file.seek(start)
            file.write(array)
    into.send((pickled, sizes))


def _mapped(memory: int, sizes: list[int]) -> list[memoryview]:
    """Arrays in the memory of a process, of which the pages are copied only if they are changed."""
    total = sum(map(_aligned, sizes))
    if not total:
        return []
    os.ftruncate(memory, total)
    whole = memoryview(mmap.mmap(memory, total, mmap.MAP_PRIVATE))
    starts = accumulate(map(_aligned, sizes), initial=0)
    return [whole[start : start + size] for start, size in zip(starts, sizes, strict=False)]


def _aligned(size: int) -> int:
    return -(-size // _ALIGNED) * _ALIGNED


def _started(function: Callable[[], Result]) -> _Child[Result] | None:
    """A process for one computation; None if the system provides no further one."""
    try:
        return _Child(function)
    except OSError:
        return None
