# SPDX-License-Identifier: BSD-3-Clause
"""Batched inverse dynamics and regressor against pinocchio, one thread, float64.

Run with ``python benchmarks/engine/bench_batch.py [n_samples]``. Needs pinocchio (``pip install
pin``). Prints microseconds per sample and ratios, higher is faster; targets in the last line.
"""

from __future__ import annotations

import sys

import numpy as np
import pinocchio as pin
from _timing import branched_text, embedded_text, interleaved, models, random_tree_text

CASES = {
    "panda": lambda: embedded_text("panda"),
    "srs_arm": lambda: embedded_text("srs_arm"),
    "srs_arm, 11 digits": lambda: embedded_text("srs_arm").replace(
        "1.5707963267948966", "1.57079632679"
    ),
    "ur10e": lambda: embedded_text("ur10e"),
    "branched, slider": branched_text,
    "tree of 30": lambda: random_tree_text(30),
    "tree of 48": lambda: random_tree_text(48),
}


def measure(name: str, text: str, n_samples: int) -> None:
    """Print one line of the table."""
    robot, model, order = models(text)
    n = robot.n_joints
    if n > 20:
        n_samples //= 10
    data, pool = model.createData(), pin.ModelPool(model, 1)
    q, dq, ddq = np.random.default_rng(0).uniform(-2, 2, size=(3, n_samples, n))
    given = np.zeros((3, n_samples, model.nv))
    given[:, :, order] = q, dq, ddq
    columns = [np.asfortranarray(x.T) for x in given]
    result = np.zeros_like(columns[0])
    warm = np.zeros((n, 10 * robot.n_bodies, n_samples)) if n <= 20 else None

    def loop() -> None:
        for k in range(n_samples):
            pin.rnea(model, data, given[0, k], given[1, k], given[2, k])

    def regressor_loop() -> None:
        for k in range(n_samples):
            pin.computeJointTorqueRegressor(model, data, given[0, k], given[1, k], given[2, k])

    def chunks(backend: str) -> None:
        for _ in robot.iter_torque_regressor(q, dq, ddq, backend=backend):
            pass

    functions = {
        "loop": loop,
        "batch": lambda: pin.rneaInParallel(1, pool, *columns, result),
        "numpy": lambda: robot.inverse_dynamics(q, dq, ddq),
        "float32": lambda: robot.inverse_dynamics(q, dq, ddq, dtype=np.float32),
        "compiled": lambda: robot.inverse_dynamics(q, dq, ddq, backend="compiled"),
        "reg loop": regressor_loop,
        "reg chunk": lambda: chunks("numpy"),
        "reg chunk C": lambda: chunks("compiled"),
    }
    if n > 20:  # a body of thousands of lines takes the compiler minutes
        del functions["reg chunk C"]
    else:
        functions["reg warm"] = lambda: robot.torque_regressor(q, dq, ddq, out=warm)
        functions["reg warm C"] = lambda: robot.torque_regressor(
            q, dq, ddq, out=warm, backend="compiled"
        )
    pin.rneaInParallel(1, pool, *columns, result)
    error = np.abs(robot.inverse_dynamics(q, dq, ddq) - result.T[:, order]).max()
    t = interleaved(functions, n_samples, rounds=5)
    others = ("reg warm", "reg chunk C", "reg warm C")
    ratios = "".join(f"{t['reg loop'] / t[x]:6.1f}" if x in t else "     -" for x in others)
    print(
        f"{name:20s}{error:9.1e}{t['loop']:8.3f}{t['numpy']:8.3f}{t['compiled']:8.3f} |"
        f"{t['loop'] / t['numpy']:6.1f}{t['batch'] / t['numpy']:6.1f}"
        f"{t['loop'] / t['float32']:6.1f}{t['loop'] / t['compiled']:7.1f} |"
        f"{t['reg loop']:8.3f}{t['reg chunk']:8.3f} |"
        f"{t['reg loop'] / t['reg chunk']:6.1f}{ratios}",
        flush=True,
    )


def main() -> None:
    """Print the table."""
    n_samples = int(sys.argv[1]) if len(sys.argv) > 1 else 50_000
    print(
        "                       error    inverse dynamics, us  |  loop  batch  loop   loop   |"
        "  regressor, us |  loop/numpy   loop/compiled"
    )
    print(
        "                       N m      loop   numpy compiled | numpy numpy   f32 compiled|"
        "   loop   chunk | chunk  warm chunk  warm"
    )
    for name, text in CASES.items():
        measure(name, text(), n_samples)
    print("targets: loop/numpy 5, batch/numpy 2.5, loop/compiled 15, regressor 5 and 3; trees 2")


if __name__ == "__main__":
    main()
