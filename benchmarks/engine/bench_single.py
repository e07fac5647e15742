# SPDX-License-Identifier: BSD-3-Clause
"""One sample at a time: Python, exported C through ctypes, pinocchio.

Run with ``python benchmarks/engine/bench_single.py``. Needs pinocchio and a C compiler.
Prints percentiles of the CPU time of a call in microseconds, minus that of an empty call, because
wall time includes interruptions on a busy machine.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin
from _timing import embedded_text, models

from skidyn.dynamics._compiled import compile_library
from skidyn.export import c_source

N_CALLS = 20_000


def percentiles(functions: dict[str, Callable[[], object]]) -> None:
    """Time the functions in turns and print 50, 99 and 99.9 %."""
    times = {name: np.empty(N_CALLS) for name in functions}
    for k in range(N_CALLS):
        for name, function in functions.items():
            start = time.thread_time()
            function()
            times[name][k] = time.thread_time() - start
    empty = np.median(times.pop("empty"))
    for name, values in times.items():
        shown = "".join(f"{x * 1e6:9.2f}" for x in np.percentile(values - empty, (50, 99, 99.9)))
        print(f"  {name:34s}{shown}")


def measure(name: str) -> None:
    """Print the lines of one robot."""
    robot, model, _ = models(embedded_text(name))
    data = model.createData()
    states = np.random.default_rng(0).normal(size=(3, 1, robot.n_joints))
    rows = states[:, 0].copy()
    out = np.empty(robot.n_joints)
    function = compile_library(
        c_source(robot, name="torque"), ("-O2", "-march=native", "-shared", "-fPIC")
    ).torque
    function.restype = None
    pointers = [ctypes.c_void_p(x.ctypes.data) for x in (*rows, out)]
    percentiles(
        {
            "Robot.inverse_dynamics": lambda: robot.inverse_dynamics(*states),
            "Robot.torque_regressor": lambda: robot.torque_regressor(*states),
            "exported C through ctypes": lambda: function(*pointers),
            "pinocchio.rnea": lambda: pin.rnea(model, data, *rows),
            "empty": lambda: None,
        }
    )


def main() -> None:
    """Print the table."""
    print(f"{'us per call':36s}{'p50':>9s}{'p99':>9s}{'p99.9':>9s}")
    for name in ("panda", "srs_arm", "ur10e"):
        print(name)
        measure(name)


if __name__ == "__main__":
    main()
