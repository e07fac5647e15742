# SPDX-License-Identifier: BSD-3-Clause
"""The suite: logs drawn by seed, with their hidden effects and tiers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._writing import replacing, write_json, write_text
from skidyn.datasets.suite._case import NAMED, TIERS, simulate
from skidyn.datasets.suite._hidden import Maker
from skidyn.datasets.suite._nameless import NAMELESS
from skidyn.datasets.suite._once import ONCE
from skidyn.datasets.suite._robots import DRIVES, urdf_of

if TYPE_CHECKING:
    from sklearn.utils import Bunch

#: Hidden contents of a log, with their shares of the suite.
CONTENTS = {"nothing": 0.2, "one": 0.48, "two": 0.1, "nameless": 0.14, "once": 0.08}
POOLS: dict[str, dict[str, Maker]] = {
    "one": NAMED,
    "two": NAMED,
    "nameless": NAMELESS,
    "once": ONCE,
}
#: Two effects of one set cannot be separated by any tool.
RIVALS = (
    {"dahl", "lugre", "maxwell_slip"},
    {"backlash", "joint_elasticity"},
    {"friction_drift", "temperature_friction", "temperature_offset"},
    {"external_wrench", "payload"},
)
#: Effects that need an arm in space, or three joints.
SPATIAL = {"base_tilt", "environment_contact", "external_wrench", "payload"}
SPATIAL |= {"field_around_a_point", "one_cause_on_three", "pushes", "sum_of_positions"}


@dataclass(frozen=True)
class SuiteCase:
    """One log of the suite, before it is simulated.

    Parameters
    ----------
    name : str
        Such as ``"case_017"``.
    robot : str
        Embedded robot: ``panda, planar_arm, scara, srs_arm, ur10e`` or ``ur5``.
    tier : str
        ``low``, ``high``, ``hard``, ``short`` or ``rough``.
    content : str
        ``nothing``, ``one``, ``two``, ``nameless`` or ``once`` (in one trajectory only).
    kinds : tuple of str
        Hidden effects: kinds of the catalogue, or effects that are not in the catalogue.
    entropy : tuple of int
        Seed of the suite and number of the case; the source of all random numbers.

    Examples
    --------
    >>> from skidyn.datasets import hidden_effect_suite
    >>> case = hidden_effect_suite(seed=0, n_logs=1, contents=["nothing"])[0]
    >>> case.name, case.content, case.kinds
    ('case_000', 'nothing', ())
    """

    name: str
    robot: str
    tier: str
    content: str
    kinds: tuple[str, ...]
    entropy: tuple[int, int]

    def make(self) -> Bunch:
        """Simulate the log.

        Returns
        -------
        Bunch
            ``frame``: DataFrame with ``time, trajectory, q1 .., dq1 .., [ddq1 ..], tau1 ..,
            [temp1 ..]`` in SI units; ``urdf``: text of the nominal robot; ``meta``: information for
            the tool (``base_model``, rate, resolution); ``truth``: the hidden effects.

        Raises
        ------
        ImportError
            MuJoCo or pyarrow is not installed (extras ``mujoco`` and ``io``).

        Examples
        --------
        >>> from skidyn.datasets import hidden_effect_suite
        >>> log = hidden_effect_suite(0, 1)[0].make()  # doctest: +SKIP
        >>> log.meta["base_model"]  # doctest: +SKIP
        ['rigid_body', 'viscous', 'coulomb', 'rotor_inertia']
        """
        import pandas as pd
        from sklearn.utils import Bunch  # a second of imports: only where a log is made

        columns, meta, truth = simulate(self)
        return Bunch(frame=pd.DataFrame(columns), urdf=urdf_of(self.robot), meta=meta, truth=truth)

    def write(self, folder: str | Path) -> Path:
        """Simulate the log into ``folder/name``: ``log.parquet``, ``robot.urdf``, ``meta.json``.

        The truth is not written into this folder, so that it can be given to any tool.

        Parameters
        ----------
        folder : str or Path
            Folder of the suite; made if it does not exist.

        Returns
        -------
        Path
            ``truth/name.json`` beside the case's folder.
        """
        log = self.make()
        case, truth = Path(folder, "cases", self.name), Path(folder, "truth", f"{self.name}.json")
        with replacing(case / "log.parquet") as part:
            log.frame.to_parquet(part, index=False)
        write_text(case / "robot.urdf", log.urdf)
        write_json(case / "meta.json", log.meta)
        return write_json(truth, log.truth)


def hidden_effect_suite(
    seed: int = 0,
    n_logs: int = 60,
    *,
    tiers: Sequence[str] | None = None,
    contents: Sequence[str] | None = None,
) -> tuple[SuiteCase, ...]:
    """Logs with and without hidden effects, for comparing tools that diagnose robot models.

    MuJoCo integrates every robot forward in time (0.5 ms) under a tracking controller with nominal
    feed-forward, so that no tool is evaluated on its own equations. Link parameters are 10 to 20 %
    off the URDF, friction is dry, encoders have steps, torque noise is partly coloured.

    Parameters
    ----------
    seed : int, default=0
        Seed of the suite. The first logs of a larger suite are those of a smaller one.
    n_logs : int, default=60
        Number of logs.
    tiers : sequence of str, optional
        Only these: ``low`` and ``high`` torque noise, ``hard`` (weak effects under high noise),
        ``short`` (six trajectories of 2 to 6 s), ``rough`` (coarse encoder, jittered stamps, lost
        rows). All by default.
    contents : sequence of str, optional
        Only logs with ``nothing`` hidden, ``one`` effect, ``two``, a ``nameless`` torque, or an
        effect in one trajectory only (``once``). All by default, in fixed shares.

    Returns
    -------
    tuple of SuiteCase
        Cases, not simulated yet: ``case.make()`` simulates one in a few seconds.

    Raises
    ------
    SkidynError
        A tier or content that does not exist, or no logs.

    See Also
    --------
    score_answers : Compares a tool's answers with the truth.

    Examples
    --------
    >>> from skidyn.datasets import hidden_effect_suite
    >>> suite = hidden_effect_suite(seed=1, n_logs=3)
    >>> [case.name for case in suite]
    ['case_000', 'case_001', 'case_002']
    >>> suite[:2] == hidden_effect_suite(seed=1, n_logs=2)
    True
    """
    chosen_tiers = _known("tier", tiers, tuple(TIERS))
    chosen_contents = _known("content", contents, tuple(CONTENTS))
    if n_logs < 1:
        raise SkidynError(f"n_logs must be at least 1; got {n_logs}.")
    return tuple(_draw(seed, k, chosen_tiers, chosen_contents) for k in range(n_logs))


def _pick(pool: list[str], count: int, rng: np.random.Generator) -> list[str]:
    """Kinds that can be separated if both are present."""
    while True:
        names = [str(name) for name in rng.choice(pool, count, replace=False)]
        if not any(len(rivals.intersection(names)) > 1 for rivals in RIVALS):
            return names


def _known(what: str, asked: Sequence[str] | None, all_of: tuple[str, ...]) -> tuple[str, ...]:
    if asked is None:
        return all_of
    wrong = [name for name in asked if name not in all_of]
    if wrong or not asked:
        raise SkidynError(
            f"{what} {', '.join(wrong) or '()'} does not exist; known: {', '.join(all_of)}."
        )
    return tuple(asked)


def _draw(seed: int, number: int, tiers: tuple[str, ...], contents: tuple[str, ...]) -> SuiteCase:
    rng = np.random.default_rng([seed, number])
    share = np.array([CONTENTS[name] for name in contents])
    content = str(rng.choice(contents, p=share / share.sum()))
    tier = str(rng.choice(tiers))
    count = {"nothing": 0, "two": 2}.get(content, 1)
    names = _pick(sorted(POOLS[content]), count, rng) if count else []
    kinds = tuple(names)
    spatial = SPATIAL.intersection(kinds) or content == "once"
    robots = sorted(name for name in DRIVES if not (spatial and name == "planar_arm"))
    return SuiteCase(
        f"case_{number:03d}", str(rng.choice(robots)), tier, content, kinds, (seed, number)
    )
