# SPDX-License-Identifier: BSD-3-Clause
"""Inverse dynamics through the system's C compiler."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara, load_ur5


@pytest.mark.parametrize("load", [load_panda, load_scara, load_ur5])
@pytest.mark.parametrize("n_samples", [0, 1, 63, 64, 65, 1000])
def test_compiled_equals_numpy(c_compiler, load, n_samples):
    robot = load()
    states = np.random.default_rng(0).normal(size=(3, n_samples, robot.n_joints))
    parameters = np.random.default_rng(1).normal(size=(robot.n_bodies, 10))
    for options in ({}, {"parameters": parameters}, {"gravity": (1.0, 2.0, 3.0)}):
        compiled = robot.inverse_dynamics(*states, backend="compiled", **options)
        np.testing.assert_allclose(compiled, robot.inverse_dynamics(*states, **options), atol=1e-11)


def test_signals_of_any_memory_order(c_compiler):
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 4, 100)).transpose(0, 2, 1)
    compiled = robot.inverse_dynamics(q, dq, ddq, backend="compiled")
    np.testing.assert_allclose(compiled, robot.inverse_dynamics(q, dq, ddq), atol=1e-12)


def test_without_a_compiler_the_error_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    robot = load_scara()
    q = np.zeros((1, 4))
    with pytest.raises(ValueError, match="needs a C compiler"):
        robot.inverse_dynamics(q, q, q, gravity=(0, 0, -1.62), backend="compiled")


def test_unknown_backend_and_precision():
    robot = load_scara()
    q = np.zeros((1, 4))
    with pytest.raises(ValueError, match="backend is 'fortran'"):
        robot.inverse_dynamics(q, q, q, backend="fortran")
    with pytest.raises(ValueError, match="float64 only"):
        robot.inverse_dynamics(q, q, q, backend="compiled", dtype=np.float32)


def test_compiled_regressor_equals_numpy_whole_in_chunks_and_into_used_memory(c_compiler):
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 700, robot.n_joints))
    expected = robot.torque_regressor(q, dq, ddq)

    whole = robot.torque_regressor(q, dq, ddq, backend="compiled")
    chunks = robot.iter_torque_regressor(q, dq, ddq, backend="compiled")
    pieces = np.concatenate([chunk.copy() for _, chunk in chunks], axis=2)
    used = np.full((robot.n_joints, 10 * robot.n_bodies, 700), 7.0)
    into = robot.torque_regressor(q, dq, ddq, out=used, backend="compiled")

    for got in (whole, np.moveaxis(pieces, -1, 0), into):
        np.testing.assert_allclose(got, expected, atol=1e-12)
    assert np.shares_memory(into, used)
    with pytest.raises(ValueError, match="out has shape"):
        robot.torque_regressor(q, dq, ddq, out=used[..., :5], backend="compiled")
    with pytest.raises(ValueError, match="works in float64 only"):
        robot.torque_regressor(q, dq, ddq, dtype=np.float32, backend="compiled")
