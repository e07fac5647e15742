# SPDX-License-Identifier: BSD-3-Clause
"""figaroh: base and drive parameters by least squares with one weight per joint.

figaroh models viscous and dry friction, rotor inertia and an offset of each joint. Those that the
base model lacks are claimed if their relative standard deviation, computed as in figaroh, is below
10 %, the usual limit in the field. Samples of a joint at rest are left out, because dry friction
may have any value there.
"""

from types import SimpleNamespace

import numpy as np
import pinocchio
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import build_regressor_basic

PACKAGE = "figaroh"
#: Columns other than those of rigid bodies, in figaroh's order.
KINDS = ("viscous", "coulomb", "rotor_inertia", "offset")
VALUES = dict(zip(KINDS, ("Fv", "Fc", "Ia", "tau0"), strict=True))
SAMPLES = 4000
LIMIT = 10.0
#: A joint is at rest below this share of the speed that it exceeds in 5 % of the log.
REST = 0.05
#: Indices of mass, moments and inertia, in the suite's order, in pinocchio's ten parameters.
BODY = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


def regressor(model, q, dq, ddq) -> np.ndarray:
    """Columns of figaroh; the rows of one joint follow those of the previous one."""
    robot = SimpleNamespace(model=model, data=model.createData())
    settings = {"act_idxv": list(range(model.nv)), "is_joint_torques": True}
    more = ("has_friction", "has_actuator_inertia", "has_joint_offset")
    return build_regressor_basic(robot, q, dq, ddq, settings | dict.fromkeys(more, True))


def identify(
    model, motion, use, rest=REST
) -> tuple[np.ndarray, dict[tuple[str, int], tuple[float, float]]]:
    """All parameters, zero if not identifiable, and deviations of those of drives."""
    n = model.nv
    some = np.flatnonzero(use)[:: max(1, int(use.sum()) // SAMPLES)]
    speed = np.abs(motion["dq"][some])
    moves = (speed >= rest * np.quantile(speed, 0.95, axis=0)).T.ravel()
    joint = np.repeat(np.arange(n), len(some))[moves]
    W = regressor(model, *(motion[key][some] for key in ("q", "dq", "ddq")))[moves]
    tau = motion["tau"][some].T.ravel()[moves]
    seen = np.flatnonzero(np.sum(W**2, axis=0) > 1e-6)
    names = [f"p{i}" for i in seen]
    found = QRDecomposer()
    basis, _, _, phi = found.double_decomposition(tau, W[:, seen], names)
    square = np.bincount(joint, (tau - basis @ phi) ** 2) / np.bincount(joint)
    weight = 1 / np.sqrt(square[joint])
    weighted = basis * weight[:, None]
    phi = np.linalg.lstsq(weighted, tau * weight, rcond=None)[0]
    square = np.sum((tau * weight - weighted @ phi) ** 2) / (len(tau) - len(phi))
    deviation = np.sqrt(np.diag(square * np.linalg.inv(weighted.T @ weighted)))
    whole = np.zeros(W.shape[1])
    places = seen[found.base_indices]
    whole[places] = phi
    drives = {
        (KINDS[(i - 10 * n) // n], int(i - 10 * n) % n): (float(value), 100 * error / abs(value))
        for i, value, error in zip(places, phi, deviation, strict=True)
        if i >= 10 * n
    }
    return whole, drives


def as_numbers(whole: np.ndarray, n: int) -> dict[str, list]:
    """Convert the parameters to the form of the suite's simulation."""
    bodies, drives = np.split(whole, [10 * n])
    values = dict(zip(KINDS, drives.reshape(4, n).tolist(), strict=True))
    return {"bodies": bodies.reshape(n, 10)[:, BODY].tolist()} | values


def answer(log, robot) -> dict:
    model = pinocchio.buildModelFromUrdf(str(robot))
    whole, drives = identify(model, log.motion, log.use)
    sizes = np.array([np.abs(rows.base).mean() for rows in log.joints])
    effects = [
        {
            "kind": kind,
            "joints": [j + 1],
            "parameters": {VALUES[kind]: value},
            "size": float(abs(value) / sizes[j]),
        }
        for (kind, j), (value, deviation) in drives.items()
        if kind not in log.base_model and deviation < LIMIT
    ]
    effects = sorted(effects, key=lambda e: -e["size"])

    def predict(other) -> list[np.ndarray]:
        q, dq, ddq = (log.motion[key] for key in ("q", "dq", "ddq"))
        torque = (regressor(model, q, dq, ddq) @ whole).reshape(model.nv, -1)
        return [rows.from_samples(torque[j]) for j, rows in enumerate(other.joints)]

    return {
        "verdict": "missing" if effects else "complete",
        "effects": effects,
        "predict": predict,
        "model": as_numbers(whole, model.nv),
    }
