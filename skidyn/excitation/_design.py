# SPDX-License-Identifier: BSD-3-Clause
"""Optimal excitation: the most informative motion within the robot's limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from scipy.optimize import minimize

from skidyn._exceptions import SkidynError
from skidyn._progress import tell
from skidyn._signals import Array
from skidyn.excitation._basis import FourierBasis, QuinticBasis
from skidyn.excitation._excitation import Excitation
from skidyn.excitation._information import Model, evaluate, make_model, recorded_information
from skidyn.excitation._limits import MotionLimits
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

if TYPE_CHECKING:
    import torch

#: Middle pose, and weights of the basis.
Motion = tuple[Array, Array]

#: Number of samples at which a candidate's torques are judged; rates in Hz at which kinematic
#: limits are checked during the search, and all limits at its end.
JUDGED_SAMPLES, DRAFT_RATE, CHECK_RATE = 250, 100.0, 500.0
#: Number of random starts, of the best ones that are improved, and of steps for each penalty.
STARTS, FOLLOWED, ITERATIONS = 40, 2, 100
#: Share of each limit that is used, so that a tracking error does not break it.
MARGIN = 0.95
#: Order of the norm that replaces the maximum where a gradient is needed.
NORM = 60.0
#: Successive weights of exceeded torque and workspace limits; unit of length, m.
PENALTIES, LENGTH = (1e3, 1e5), 0.05
#: Share of the strokes below which a motion is rejected.
SMALLEST = 0.025
#: Share of the determinant in the criterion of the condition number.
SIZE = 0.1
#: Added to the normalised information matrix, so that directions that no motion excites do not
#: dominate.
RIDGE = 1e-9


def design_excitation(
    model: Robot | RBDRegressor,
    *,
    duration: float = 20.0,
    motion: Literal["fourier", "quintic"] = "fourier",
    base_frequency: float = 0.1,
    harmonics: int = 5,
    points: int = 10,
    blend: float = 0.5,
    criterion: Literal["determinant", "condition"] = "determinant",
    effects: Iterable[Any] | None = None,
    limits: MotionLimits | None = None,
    recorded: Any = (),
    iterations: int = ITERATIONS,
    random_state: int = 0,
) -> Excitation:
    """Design a motion from which base parameters and effects can be identified.

    Every joint follows a Fourier series that is blended from and to rest by quintic polynomials, or
    quintic polynomials between points. Limits of position, velocity and acceleration are kept by
    construction, those of torque and workspace by a penalty and finally by smaller strokes. The
    result is checked at 500 Hz.

    Parameters
    ----------
    model : Robot or RBDRegressor
        Robot with its limits. A fitted model also provides the torque, friction included, for the
        torque limits, the noise as the weights of the joints, and the effects.
    duration : float, s, default=20
        Length of the motion.
    motion : {"fourier", "quintic"}, default="fourier"
        Fourier series, or quintics between points.
    base_frequency : float, Hz, default=0.1
        Frequency of the first harmonic of a Fourier series.
    harmonics : int, default=5
        Number of harmonics of every joint.
    points : int, default=10
        Number of points between start and end, of quintics.
    blend : float, s, default=0.5
        Time in which a Fourier series is blended from and to rest.
    criterion : {"determinant", "condition"}, default="determinant"
        D-optimality (volume of the confidence ellipsoid), or the condition number of the base
        regressor with columns of equal length (and a small share of the determinant, so that the
        motion stays large).
    effects : iterable, default=None
        Effects to be identified as well, as for :class:`~skidyn.identification.RBDRegressor`. If
        None, those of a fitted model, else viscous and Coulomb friction.
    limits : MotionLimits, optional
        Limits; those of the URDF by default.
    recorded : DataFrame, Excitation or list of them, default=()
        Recordings already made, as :func:`~skidyn.logs.read_log` returns them, or motions already
        designed; the new one is chosen to complement them. They count by their length in s.
    iterations : int, default=100
        Steps of the descent from each of the two best of 40 random motions, for each of two
        penalties.
    random_state : int, default=0
        Seed of the random starts.

    Returns
    -------
    Excitation
        A motion within every limit.

    Raises
    ------
    SkidynError
        Limits are inconsistent, an effect has a memory, or even the smallest motion exceeds the
        torque or workspace limits.

    References
    ----------
    Swevers, Ganseman, Tukel, De Schutter, Van Brussel (1997), "Optimal robot excitation and
    identification", IEEE Transactions on Robotics and Automation 13(5), 730-740.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> excitation = design_excitation(load_planar_arm(), duration=5.0, iterations=2)
    >>> excitation.condition_number < 1000
    True
    """
    if criterion not in ("determinant", "condition"):
        raise SkidynError(f"criterion={criterion!r}; expected 'determinant' or 'condition'")
    if motion not in ("fourier", "quintic"):
        raise SkidynError(f"motion={motion!r}; expected 'fourier' or 'quintic'")
    basis: FourierBasis | QuinticBasis = QuinticBasis(duration, points)
    if motion == "fourier":
        basis = FourierBasis(duration, base_frequency, harmonics, blend)
        if duration <= 2 * blend:
            raise SkidynError(f"a motion of {duration} s is too short for blending of {blend} s")
    known = make_model(model, effects)
    bounds = (limits or MotionLimits()).resolved(known.robot)
    before = recorded_information(known, recorded)
    search = _Search.prepare(known, basis, bounds, before, criterion, random_state)
    excitation = _best_within(known, basis, search, iterations)
    time, q, dq, ddq = excitation.sample(CHECK_RATE)
    matrix = known.information(q, dq, ddq, duration) + before
    sign, log_determinant = np.linalg.slogdet(matrix)
    return replace(
        excitation,
        condition_number=_condition(matrix),
        log_determinant=float(log_determinant) if sign > 0 else -np.inf,
    )


def _condition(matrix: Array) -> float:
    """Condition number of the columns, scaled to equal length."""
    size = np.sqrt(np.diag(matrix))
    size = np.where(size > 0, size, 1.0)
    values = np.linalg.eigvalsh(matrix / size[:, None] / size)
    return float(np.sqrt(values[-1] / max(values[0], 1e-16)))


@dataclass(frozen=True)
class _Search:
    """Descent over unbounded numbers: for each joint its middle, share of the range, weights."""

    model: Model
    limits: MotionLimits
    draft: torch.Tensor  # the basis at equal steps of time, for kinematic limits
    judged: torch.Tensor  # the same at fewer times, for torques and information
    duration: float
    before: torch.Tensor
    scale: torch.Tensor
    criterion: str
    starts: Array

    @classmethod
    def prepare(
        cls,
        model: Model,
        basis: FourierBasis | QuinticBasis,
        limits: MotionLimits,
        before: Array,
        criterion: str,
        random_state: int,
    ) -> _Search:
        import torch

        draft, judged = (
            torch.from_numpy(np.ascontiguousarray(basis(np.linspace(0.0, basis.duration, n))))
            for n in (max(JUDGED_SAMPLES, int(DRAFT_RATE * basis.duration)), JUDGED_SAMPLES)
        )
        rng = np.random.default_rng(random_state)
        starts = rng.normal(size=(STARTS, model.robot.n_joints, 2 + judged.shape[2]))
        search = cls(
            *(model, limits, draft, judged, basis.duration, torch.from_numpy(before)),
            *(torch.ones(len(before), dtype=torch.float64), criterion, starts),
        )
        # Columns are scaled by their size in a random motion, so that one ridge suits all.
        with torch.no_grad():
            shown = [search.information(*search.states(torch.from_numpy(x))) for x in starts[:5]]
        size = torch.stack(shown).mean(0).diagonal().sqrt()
        return replace(search, scale=torch.where(size > 0, size, torch.ones_like(size)))

    def ranked(self, iterations: int) -> tuple[list[Motion], list[Motion]]:
        """Middle and weights of the improved motions, and of the starts, sorted by their loss."""
        import torch

        starts = sorted(self.starts, key=self._worth)
        followed = starts[:FOLLOWED] if iterations else []
        found = [self._descended(x, iterations, k / FOLLOWED) for k, x in enumerate(followed)]

        def motion(x: Array) -> Motion:
            middle, weights = self.motion(torch.from_numpy(x))
            return middle.numpy(), weights.numpy()

        with torch.no_grad():
            return [motion(x) for x in found], [motion(x) for x in starts]

    def _worth(self, x: Array) -> float:
        """Loss under the last penalty, because strokes that exceed a limit are reduced later."""
        import torch

        with torch.no_grad():
            return float(self.loss(torch.from_numpy(x), PENALTIES[-1]))

    def _descended(self, x: Array, iterations: int, done: float) -> Array:
        import torch

        def value(flat: Array, penalty: float) -> tuple[float, Array]:
            unknown = torch.from_numpy(flat.reshape(x.shape)).requires_grad_()
            loss = self.loss(unknown, penalty)
            (slope,) = torch.autograd.grad(loss, unknown)
            return float(loss.detach()), slope.numpy().ravel()

        options = {"maxiter": iterations, "ftol": 1e-8}
        penalties = PENALTIES if self._is_bound() else PENALTIES[-1:]
        part = 1 / (FOLLOWED * len(penalties))
        for k, penalty in enumerate(penalties):
            found = minimize(
                value,
                x.ravel(),
                (penalty,),
                jac=True,
                method="L-BFGS-B",
                callback=_teller(done + k * part, part / iterations),
                options=options,
            )
            x = found.x.reshape(x.shape)
        return x

    def _is_bound(self) -> bool:
        """Whether there are limits that a penalty enforces."""
        return self.limits.workspace is not None or bool(np.isfinite(self.limits.torque).any())

    def motion(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Middle pose within the middle of the range, and weights within the kinematic limits.

        The descent uses slightly narrower limits, and approaches them smoothly.
        """
        import torch

        low, high = (torch.from_numpy(side.copy()) for side in self.limits.position.T)
        middle = (low + high) / 2 + 0.5 * torch.tanh(x[:, 0]) * (high - low) / 2
        weights = x[:, 2:]
        away, speed, change = self.draft @ weights.T
        room = torch.cat(
            [
                away / (high - middle),
                away / (low - middle),
                speed.abs() / torch.from_numpy(self.limits.velocity),
                change.abs() / torch.from_numpy(self.limits.acceleration),
            ]
        )
        taken = _high_norm(room) if x.requires_grad else room.amax(0)
        share = MARGIN * torch.sigmoid(x[:, 1] + 3.0)
        return middle, weights * (share / taken)[:, None]

    def states(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Position, velocity and acceleration at the judged times."""
        middle, weights = self.motion(x)
        q, dq, ddq = self.judged @ weights.T
        return q + middle, dq, ddq

    def information(self, q: torch.Tensor, dq: torch.Tensor, ddq: torch.Tensor) -> torch.Tensor:
        """Information matrix, with that of the recordings."""
        return self.model.information_torch(q, dq, ddq, self.duration) + self.before

    def loss(self, x: torch.Tensor, penalty: float) -> torch.Tensor:
        """Function to be minimised."""
        states = self.states(x)
        return self.score(self.information(*states)) + penalty * self._violation(*states)

    def score(self, information: torch.Tensor) -> torch.Tensor:
        """The criterion; smaller is better."""
        import torch

        matrix = information / self.scale[:, None] / self.scale
        score = -torch.logdet(matrix + RIDGE * torch.eye(len(matrix), dtype=matrix.dtype))
        if self.criterion == "condition":
            size = matrix.diagonal().clamp_min(RIDGE).sqrt()
            values = torch.linalg.eigvalsh(matrix / size[:, None] / size)
            ratio = 0.5 * (values[-1].log() - values[0].clamp_min(1e-14).log())
            # It does not depend on the size of a motion; a small share of the determinant does.
            score = ratio + SIZE * score / len(matrix)
        return score

    def _violation(self, q: torch.Tensor, dq: torch.Tensor, ddq: torch.Tensor) -> torch.Tensor:
        """Excess over torque and workspace limits: mean squares, zero where the limits are kept."""
        import torch

        from skidyn.dynamics import evaluate_torch as run

        total = q.new_zeros(())
        if np.isfinite(self.limits.torque).any():
            torque = run(self.model.torque, {"q": q, "dq": dq, "ddq": ddq})
            taken = torque.abs() / torch.from_numpy(self.limits.torque)
            total = total + ((taken - MARGIN).clamp_min(0.0) ** 2).mean(0).sum()
        if self.limits.workspace is not None:
            pose = run(_pose(self.model.robot), {"q": q})
            depth = -self._clearance(pose[:, :, 3]) / LENGTH
            total = total + (depth.clamp_min(0.0) ** 2).mean()
        return total

    def _clearance(self, position: torch.Tensor) -> torch.Tensor:
        """Clearance in the workspace with its slope, by differences of the given function."""
        import torch

        here = position.detach().numpy()
        value = self.limits.clearance(here)
        step = 1e-6 * np.eye(3)
        slope = np.stack([(self.limits.clearance(here + d) - value) / 1e-6 for d in step], axis=1)
        moved = position - position.detach()
        return torch.from_numpy(value) + (moved * torch.from_numpy(slope)).sum(1)


def _high_norm(values: torch.Tensor) -> torch.Tensor:
    """Norm of each column that is little above its largest value.

    The best motion reaches its limits at many times at once. The slope of the maximum itself
    depends on only one of them and would mislead a descent.
    """
    largest = values.detach().amax(0)
    return largest * ((values / largest).clamp_min(0.0) ** NORM).sum(0) ** (1.0 / NORM)


def _pose(robot: Robot) -> Any:
    return robot._engine.program("pose", robot.n_bodies - 1, None)


def _full(excitation: Excitation, limits: MotionLimits) -> Excitation:
    """Strokes scaled to the limits at all times, since the search checks fewer times."""
    _, q, dq, ddq = excitation.sample(CHECK_RATE)
    low, high = limits.position.T - excitation.middle
    away = q - excitation.middle
    taken = np.max(
        [
            np.max(np.maximum(away / high, away / low), axis=0),
            np.max(np.abs(dq), axis=0) / limits.velocity,
            np.max(np.abs(ddq), axis=0) / limits.acceleration,
        ],
        axis=0,
    )
    return replace(
        excitation, weights=excitation.weights * np.minimum(1.0, MARGIN / taken)[:, None]
    )


def _best_within(
    model: Model, basis: FourierBasis | QuinticBasis, search: _Search, iterations: int
) -> Excitation:
    """The best motion that keeps every limit, with smaller strokes if necessary.

    Smaller strokes reduce the quality of some motions much more than of others, so motions are
    compared with their final strokes; of random starts, the first that keeps the limits is used.
    """
    import torch

    def score(excitation: Excitation) -> float:
        _, *states = excitation.sample(DRAFT_RATE)
        return float(search.score(search.information(*map(torch.from_numpy, states))))

    found, starts = search.ranked(iterations)
    broken: list[str] = []
    allowed = []
    for middle, weights in found:
        trial, broken = _within(model, Excitation(model.robot, basis, middle, weights), search)
        allowed += [trial] if trial else []
    if allowed:
        return min(allowed, key=score)
    for middle, weights in starts:
        trial, broken = _within(model, Excitation(model.robot, basis, middle, weights), search)
        if trial:
            return trial
    raise SkidynError(
        f"no motion was found within the limits of {' and '.join(broken)}; widen them, or "
        "restrict the position limits to admissible poses"
    )


def _within(
    model: Model, excitation: Excitation, search: _Search
) -> tuple[Excitation | None, list[str]]:
    """The motion with strokes as large as the limits allow, or the limits that its pose breaks."""
    whole = _full(excitation, search.limits)
    broken = broken_limits(model, replace(whole, weights=SMALLEST * whole.weights), search.limits)
    if broken:
        return None, broken  # the pose itself breaks a limit
    for share in np.linspace(1.0, SMALLEST, 40)[:-1]:
        trial = replace(whole, weights=share * whole.weights)
        broken = broken_limits(model, trial, search.limits)
        if not broken:
            return trial, []
    return None, broken


def broken_limits(model: Model, excitation: Excitation, limits: MotionLimits) -> list[str]:
    """Names of the limits that a motion breaks on a dense grid, start and stop included."""
    _, q, dq, ddq = excitation.sample(CHECK_RATE)
    low, high = limits.position.T
    torque = evaluate(model.torque, q, dq, ddq)
    position, _ = model.robot.forward_kinematics(q)
    kept = {
        "position": np.all((q >= low) & (q <= high)),
        "velocity": np.all(np.abs(dq) <= limits.velocity),
        "acceleration": np.all(np.abs(ddq) <= limits.acceleration),
        "torque": np.all(np.abs(torque) <= limits.torque),
        "workspace": np.all(limits.clearance(position) >= 0.0),
    }
    return [name for name, holds in kept.items() if not holds]


def _teller(done: float, step: float) -> Callable[[Array], None]:
    """Callback that reports the progress of the design after each step of a descent."""
    steps = count(1)
    return lambda x: tell("Designing the motion", done + next(steps) * step)
