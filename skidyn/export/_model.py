# SPDX-License-Identifier: BSD-3-Clause
"""What exporters need to know of a fitted model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._signals import SIGN_BLUR, Signals

if TYPE_CHECKING:
    from skidyn.rigid_body import RBDRegressor

#: Effects that are one coefficient per joint times dq, sign(dq), ddq or 1.
_HELD = ("viscous", "coulomb", "rotor_inertia", "offset")


def model_terms(model: RBDRegressor) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arguments with which the exporters write a fitted model.

    Parameters
    ----------
    model : RBDRegressor
        A fitted model.

    Returns
    -------
    terms : dict
        Keyword arguments of :func:`c_source` and :func:`python_source`: ``parameters``, ``blur``
        and those of ``viscous``, ``coulomb``, ``rotor_inertia``, ``offset`` that the model has.
    rest : dict
        Effects that are none of these, by name, with their coefficients and shape: what the
        exported function leaves out; to be passed as ``effects`` to :func:`write_urdf` and
        :func:`write_mjcf`.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import model_terms, python_source
    >>> from skidyn.rigid_body import RBDRegressor
    >>> robot = load_planar_arm()
    >>> q, dq, ddq = np.random.default_rng(0).normal(size=(3, 300, 2))
    >>> tau = robot.inverse_dynamics(q, dq, ddq) + 0.3 * dq
    >>> model = RBDRegressor(robot, effects=("viscous",)).fit(np.hstack([q, dq, ddq]), tau)
    >>> terms, rest = model_terms(model)
    >>> sorted(terms), rest
    (['blur', 'parameters', 'viscous'], {})
    >>> namespace = {}
    >>> exec(python_source(robot, **terms), namespace)
    >>> bool(np.allclose(namespace["inverse_dynamics"](q, dq, ddq), tau, atol=0.05))
    True
    """
    robot = model.robot_
    sliding = np.array([kind == "prismatic" for kind in robot.joint_types])
    zero = np.zeros((1, robot.n_joints))
    at_rest = Signals(zero, zero, zero, np.zeros(1, dtype=int), prismatic=sliding)
    terms: dict[str, Any] = {
        "parameters": model.inertial_parameters_,
        "blur": SIGN_BLUR * at_rest.unit,
    }
    rest: dict[str, Any] = {}
    for term, coefficients in model.effect_coefficients_.items():
        if term.kind in _HELD and len(term.joints) == 1:
            terms.setdefault(term.kind, np.zeros(robot.n_joints))[term.joints[0]] = coefficients[0]
        else:
            joints = [robot.joint_names[j] for j in term.joints]
            rest[f"{term.kind} of {', '.join(joints)}"] = {
                "coefficients": coefficients,
                "shape": dict(term.shape),
            }
    return terms, rest
