# SPDX-License-Identifier: BSD-3-Clause
"""A check: one suspicion about a measurement."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Certainty, Remedy, Suspicion


class Check(ABC):
    """Check for one kind of mistake in a measurement.

    A subclass defines the suspicion and its test; :func:`skidyn.measurement.list_checks` returns
    them in the order of their influence on the result.

    Attributes
    ----------
    name : str
        Short name, as in reports.
    suspects : str
        Its suspicion, for the table of checks.
    stage : {0, 1, 2}
        0: uses the columns only; 1: fits the robot to find the correct interpretation of the
        columns; 2: fits the robot to correctly interpreted columns. A fit of columns in wrong
        units, or of the wrong joint, is meaningless, so a check is left out if one of an earlier
        stage has found such an error (:func:`skidyn.measurement.check_measurement`).
    misnames : bool
        Whether the mistake would be reported as a physical effect, so that a diagnosis identifies
        no effect if the check suspects it. False if a missing effect may be confused with the
        mistake: a spring with a zero or a sign, a payload of one recording with an inconsistent
        recording.
    of_sensor : bool
        Whether it concerns the torque sensor; left out if the torque was computed from the commands
        of servos.

    Examples
    --------
    >>> from skidyn.measurement import list_checks
    >>> list_checks()[0].name
    'padded'
    """

    name: ClassVar[str]
    suspects: ClassVar[str]
    stage: ClassVar[int] = 0
    misnames: ClassVar[bool] = False
    of_sensor: ClassVar[bool] = False

    @abstractmethod
    def look(self, measurement: Measurement) -> Iterable[Suspicion]:
        """Run the check on a measurement.

        Parameters
        ----------
        measurement : Measurement
            Recording and robot.

        Returns
        -------
        iterable of Suspicion
            Suspicions of the check; empty if there are none.
        """

    def suspicion(
        self,
        suspicion: str,
        evidence: str,
        certainty: Certainty,
        joints: Iterable[int] = (),
        remedy: tuple[str, str] | None = None,
    ) -> Suspicion:
        """Make a suspicion with the name of this check.

        Parameters
        ----------
        suspicion : str
            The suspicion, as a clause.
        evidence : str
            The evidence in numbers.
        certainty : {"certain", "suspected", "noted"}
            Certainty of the suspicion.
        joints : iterable of int, default=()
            Joints concerned, counted from 0; the suspicion counts them from 1. Empty if it concerns
            the whole measurement.
        remedy : (str, str) or None, default=None
            Option of the command line and the same as an argument in Python, as of
            :class:`skidyn.measurement.Remedy`; None where none is known.

        Returns
        -------
        Suspicion
            The suspicion, with the name of this check.
        """
        return Suspicion(
            self.name,
            suspicion,
            evidence,
            certainty,
            tuple(int(j) + 1 for j in joints),
            None if remedy is None else Remedy(*remedy),
        )
