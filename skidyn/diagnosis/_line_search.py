# SPDX-License-Identifier: BSD-3-Clause
"""Explanations by lines of a spectrum: torque ripple and vibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._hypothesis import UNKNOWN, Hypothesis, within_recordings
from skidyn.diagnosis._periodic import find_periodic
from skidyn.diagnosis._profile import log_likelihood_gain, profile_error
from skidyn.diagnosis._recording_search import RecordingSearch
from skidyn.diagnosis._rule import FEW_WAVES, HARMONIC, NO_SINE, RESOLVED
from skidyn.diagnosis._spectrum import Line, find_lines, find_vibrations


class LineSearch(RecordingSearch):
    """A search that looks for lines of the spectrum over position and over time."""

    def lines(self) -> list[Hypothesis]:
        """Torque ripple and vibration, judged on the residual at the full rate."""
        if "torque_ripple" not in self.kinds and not self.vibration:
            return []
        problem = self.problem
        residual = self.residual
        found, joints = [], sorted(self.looked.joints("lines"))
        least = self.settings.least_share
        if "torque_ripple" in self.kinds:
            lines = find_lines(problem, residual, self.significant, joints)
            free = [j for j in joints if not self._harmonic(j)]
            sines = np.zeros(problem.n_joints)
            for line in lines:
                sines[line.joint] = max(sines[line.joint], line.gain.sum())
            periodic = find_periodic(problem, residual, free, self.significant)
            lines += [own for own in periodic if own.gain.sum() > NO_SINE * sines[own.joint]]
            lines = list(filter(self._is_ripple, lines))
            shortest = 1.0 / problem.signals.unit.max()
            found.append(self._of_lines("torque_ripple", "N", shortest, lines, least))
        if self.vibration:
            # On samples, which are far more than rows.
            least = self.settings.least_drop * len(residual) / max(1, problem.rows.counts.max())
            lines = find_vibrations(problem, residual, self.significant, joints)
            found.append(self._of_lines(UNKNOWN, "frequency", 0.1, lines, least))
        return [h for h in found if h is not None]

    def _of_lines(
        self, kind: str, position: str, width: float, lines: Sequence[Line], least: float
    ) -> Hypothesis | None:
        """The strongest line of every joint that is large enough, significant and new."""
        problem = self.problem
        known = [c for h in self.findings if h.torque is not None for c in h.candidates]
        best: dict[int, Line] = {}
        for line in lines:
            at = line.term.shape[position]
            if any(
                c.term.kind == line.term.kind
                and c.joints == (line.joint,)
                and abs(c.term.shape[position] - at) < width
                for c in known
            ):
                continue
            strong = line.gain.sum() > least * int(problem.rows.counts[line.joint])
            if (
                strong
                and self.significant(line.chance)
                and (line.joint not in best or line.gain.sum() > best[line.joint].gain.sum())
            ):
                best[line.joint] = line
        if not best:
            return None
        gain, torque = np.zeros(problem.n_joints), np.zeros_like(problem.torque)
        candidates = []
        for joint, line in best.items():
            gain[joint] = line.gain.sum()
            torque[:, joint] = line.torque
            variables = ("time",) if kind == UNKNOWN else ()
            rows = problem.term_rows(line.term)
            own = Candidate(kind, line.term, rows, variables, n_parts=line.n_parts)
            candidates.append(own)
        count = sum(c.width + 1 for c in candidates)
        score = float(gain.sum()) - 2 * count
        score -= sum(2 * float(np.log(c.n_parts)) for c in candidates)
        chances = tuple(best[c.joints[0]].chance for c in candidates)
        return Hypothesis(kind, tuple(candidates), gain, score, count, chances, torque=torque)

    def _harmonic(self, joint: int) -> list[float]:
        """Waves per rad, or per m, of ripple in a further form that was found on a joint."""
        found = [c.term for h in self.findings for c in h.candidates if c.kind == "torque_ripple"]
        own = [term.shape for term in found if term.places == (joint,) and term.form]
        return [shape[name] for shape in own for name in ("N", "second") if name in shape]

    def _is_ripple(self, line: Line) -> bool:
        """Whether a line is neither an error of another function of the position nor a harmonic.

        It has too many waves for the first.
        """
        joint, signals = line.joint, self.problem.signals
        own, waves = f"q{joint + 1}", line.term.shape["N"]
        orders = [waves / first for first in self._harmonic(joint)]
        if any(abs(order - round(order)) < HARMONIC for order in orders):
            return False
        for h in self.findings:
            nameless = h.kind == UNKNOWN and own in h.variables and joint in h.joints
            if nameless and waves * signals.unit[joint] < RESOLVED:
                return False
            few = waves * np.ptp(signals.q[:, joint]) < 2 * np.pi * FEW_WAVES
            if few and self.of_one_position(h, joint):
                return False
        return True

    def of_one_position(self, hypothesis: Hypothesis, joint: int) -> bool:
        """Whether on a joint it is a force over the position of this joint, in all recordings.

        Parameters
        ----------
        hypothesis : Hypothesis
            A known effect or an unknown function.
        joint : int
            Joint, from 0.
        """
        if within_recordings(hypothesis) or joint not in hypothesis.joints:
            return False
        if hypothesis.kind == UNKNOWN:
            return hypothesis.torque is None and hypothesis.variables == (f"q{joint + 1}",)
        own = [c.term for c in hypothesis.candidates if joint in c.joints]
        return all(term.follows_position for term in own)

    def against_functions(self, ripple: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
        """A ripple, judged on averaged rows beside functions of the signals that explain something.

        A wave with few periods per turn fits part of any torque that depends on the position, such
        as a bump, of which a function explains much more. Samples contain all noise that is faster
        than the rows, so that the same ripple explains less of them.
        """
        rivals = [h for h in ranking if h.kind == UNKNOWN and set(h.joints) & set(ripple.joints)]
        if not rivals or ripple.kind == UNKNOWN:
            return ripple
        blocks = [*self.blocks, *(c.rows for c in ripple.candidates)]
        after = profile_error(self.problem, blocks, self.sigma, self.target)
        gain = log_likelihood_gain(self.errors_now(), after, self.problem.rows.counts)
        score, best = float(gain.sum()), max(h.score for h in rivals)
        if score <= self.settings.ripple_share * best:
            return replace(ripple, score=min(score, ripple.score))
        score -= 2 * self._price(ripple.candidates) * self._n_parameters(ripple.candidates)
        return replace(ripple, score=max(score, ripple.score))
