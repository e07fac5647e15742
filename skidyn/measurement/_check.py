# SPDX-License-Identifier: BSD-3-Clause
"""A check: one suspicion about a measurement."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Certainty, Remedy, Suspicion


class Check(ABC):
    """One mistake that a measurement may have without its owner knowing.

    A subclass says what it suspects and how it looks; :func:`skidyn.measurement.list_checks` has
    them in the order in which they change an answer.

    Attributes
    ----------
    name : str
        Short name, as reports hold it.
    suspects : str
        What it suspects, for the table of checks.
    stage : {0, 1, 2}
        0: looks at the columns alone; 1: fits the robot to find how columns are to be read; 2:
        fits the robot to columns that are read rightly. A fit of columns in other units, or of the
        wrong joint, means nothing, so a check is left out where one of an earlier stage has found
        that (:func:`skidyn.measurement.check_measurement`).
    misnames : bool
        Whether an effect that a diagnosis names would be that of the mistake, so that it names none
        where the check suspects something. Not where a missing effect may be taken for the
        mistake: a spring for a zero or a sign, a payload of one recording for an odd one.
    of_sensor : bool
        Whether it suspects the sensor of the torque; left out where the torque was computed from
        the commands of servos, which have none.

    Examples
    --------
    >>> from skidyn.measurement import list_checks
    >>> list_checks()[0].name
    'lost_rows'
    """

    name: ClassVar[str]
    suspects: ClassVar[str]
    stage: ClassVar[int] = 0
    misnames: ClassVar[bool] = False
    of_sensor: ClassVar[bool] = False

    @abstractmethod
    def look(self, measurement: Measurement) -> Iterable[Suspicion]:
        """Look at a measurement.

        Parameters
        ----------
        measurement : Measurement
            What was recorded and the robot.

        Returns
        -------
        iterable of Suspicion
            What the check suspects; empty where it finds nothing.
        """

    def suspicion(
        self,
        suspicion: str,
        evidence: str,
        certainty: Certainty,
        joints: Iterable[int] = (),
        remedy: tuple[str, str] | None = None,
    ) -> Suspicion:
        """Say what the check suspects, under its name.

        Parameters
        ----------
        suspicion : str
            What the measurement may be.
        evidence : str
            The numbers that say so.
        certainty : {"certain", "suspected", "noted"}
            How surely it is so.
        joints : iterable of int, default=()
            Joints concerned, counted from 0; the suspicion counts them from 1. Empty where it is
            about the whole measurement.
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
