# SPDX-License-Identifier: BSD-3-Clause
"""figaroh: base parameters with all that it knows of drives, least squares weighted joint by joint.

figaroh knows viscous and dry friction, rotor inertia and an offset of each joint. Of those that the
model lacks, it claims what stands out: a relative standard deviation, computed as figaroh does,
below 10 %, the limit that is usual in its field. Samples of a joint at rest are left out, where
dry friction may hold any torque.
"""

from types import SimpleNamespace

import numpy as np
import pinocchio
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import build_regressor_basic

PACKAGE = "figaroh"
#: In figaroh's order of its columns beside the rigid body.
KINDS = ("viscous", "coulomb", "rotor_inertia", "offset")
VALUES = dict(zip(KINDS, ("Fv", "Fc", "Ia", "tau0"), strict=True))
SAMPLES = 4000
LIMIT = 10.0
#: A joint rests below this share of the speed that it exceeds in 5 % of the log.
REST = 0.05
#: Mass, moments and inertia in the order that the suite asks for, of pinocchio's ten.
BODY = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


def regressor(model, q, dq, ddq) -> np.ndarray:
    """Columns of figaroh, rows joint by joint."""
    robot = SimpleNamespace(model=model, data=model.createData())
    settings = {"act_idxv": list(range(model.nv)), "is_joint_torques": True}
    more = ("has_friction", "has_actuator_inertia", "has_joint_offset")
    return build_regressor_basic(robot, q, dq, ddq, settings | dict.fromkeys(more, True))


def identify(
    model, motion, use, rest=REST
) -> tuple[np.ndarray, dict[tuple[str, int], tuple[float, float]]]:
    """All parameters (zero where others stand for them); those of drives with their deviation."""
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
    """The parameters as the suite's simulation takes them."""
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
