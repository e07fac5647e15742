# SPDX-License-Identifier: BSD-3-Clause
"""Check for torque from which that of a model was subtracted: external or residual torque.

Controllers report an external torque beside the measured one: what is left of it without gravity,
inertia and Coriolis forces of their model. It holds friction and what else the model lacks. A rigid
body with friction explains it well, so that no other check doubts it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits, friction
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import readable_fits

#: Spread of the torque of stated bodies over what they and friction leave, from which their share
#: in a torque is known; fewest such shares, since the inertia of a single joint may be described
#: wrongly by any factor; largest share of bodies in torques without them, those
#: of large torques counting most, and in any one.
STRONG, FEWEST, ABSENT, NOWHERE = 4.0, 3, 0.12, 0.4


class ExternalTorque(Check):
    """Torque without gravity and inertia, although the described bodies would cause much of it."""

    name = "external_torque"
    of_sensor = True
    suspects = "external or residual torque, from which that of a model was subtracted"
    stage = 2
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = None if measurement.scaled else readable_fits(measurement)
        if fits is None or not np.any(fits.robot.inertial_parameters):
            return
        shares, ratios = shares_of_bodies(fits)
        known = ratios > STRONG
        if known.sum() < FEWEST or np.abs(shares[known]).max() > NOWHERE:
            return
        held = float(np.linalg.norm((shares * ratios)[known]) / np.linalg.norm(ratios[known]))
        if held > ABSENT:
            return
        what = " and no ".join(PARTS[part] for part in range(2) if known[:, part].any())
        joints = np.flatnonzero(known.any(axis=1))
        yield self.suspicion(
            f"the torque contains nearly no {what}: it is an external or residual torque, from "
            "which that of a model was subtracted",
            f"it holds {100 * held:.0f} % of what the described bodies cause, which would be up "
            f"to {ratios.max():.0f} times the rest of the torque on {measurement.joints(joints)}; "
            "log the measured torque of the joints, or add that of the model again",
            "suspected",
            joints,
        )


#: Parts of the torque of bodies, in the order of columns.
PARTS = ("gravity", "inertia")


def shares_of_bodies(fits: Fits) -> tuple[Array, Array]:
    """Share of the gravity and of the inertia of stated bodies in every torque, and their size.

    Parameters
    ----------
    fits : Fits
        Rows.

    Returns
    -------
    shares : ndarray of shape (n_joints, 2)
        1 if the stated bodies are those of the robot, 0 if the torque does not contain them.
    ratios : ndarray of shape (n_joints, 2)
        Spread of the part over what all of them, and friction, leave; 0 for unused torques.
    """
    s, robot = fits.signals, fits.robot
    own = robot.inverse_dynamics(s.q, s.dq, s.ddq)
    gravity = robot.gravity_torque(s.q)
    shares, ratios = np.zeros((fits.n_joints, 2)), np.zeros((fits.n_joints, 2))
    for k in range(fits.n_joints):
        if not fits.usable(k):
            continue
        y, use = fits.mean_torque(k)
        parts = np.column_stack([gravity[:, k], own[:, k] - gravity[:, k], friction(s, k)])
        columns = fits.average(parts)[use]
        columns = np.column_stack([columns, np.ones(len(columns))])
        found = np.linalg.lstsq(columns, y[use], rcond=1e-9)[0]
        left = float(np.std(y[use] - columns @ found)) + 1e-300
        shares[k], ratios[k] = found[:2], columns[:, :2].std(axis=0) / left
    return shares, ratios
