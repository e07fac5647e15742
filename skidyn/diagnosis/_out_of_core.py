# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis of recordings larger than memory: search in a sample, test on all the rest."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from skidyn._exceptions import LogError, SkidynError
from skidyn._signals import Array
from skidyn.diagnosis._diagnosis import diagnose, own_terms
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._result import Diagnosis
from skidyn.diagnosis._rule import Settings
from skidyn.effects import make_terms
from skidyn.evidence import (
    ColumnMap,
    Evidence,
    Options,
    Source,
    column_names,
    evidence_of_sources,
    parquet_files,
    read_trajectories,
    trajectory_lengths,
)
from skidyn.identification import regressor_from_evidence, weighted_solution
from skidyn.robots import Robot, base_parameter_index

#: Least number of trajectories in the sample, for cross-validation, and in the rest.
FEWEST_TRAJECTORIES = 4
#: Rows of the sample times joints: the columns of all candidates take memory for each of both. A
#: search in so many takes 1 to 2 GB (``benchmarks/scale/out_of_core.py``).
SAMPLE = 200_000
#: Number of groups into which the rest is divided; each is predicted from all others.
GROUPS = 20
#: Largest p-value with which a finding is confirmed.
LEVEL = 0.01


@dataclass(frozen=True)
class Confirmation:
    """Error that a finding removes on all trajectories that were not used in the search.

    Parameters
    ----------
    finding : Finding
        The finding.
    rmse_without, rmse_with : dict of int to float
        Held-out error of averaged rows by joint (from 1), for the model with all other findings,
        and with this one in addition; N m or N.
    error_drop : float
        Share of the held-out squared error on the joints of the finding that it removes.
    p_value : float
        Probability of such a drop by chance, from the spread of its logarithm over groups of
        trajectories.
    confirmed : bool or None
        Whether the p-value is less than 1 %; None, with a drop of 0, for effects whose columns
        require a fit of the model first, such as load-dependent friction: these are based on the
        sample only.

    Examples
    --------
    >>> [(c.finding.kind, c.confirmed) for c in result.confirmations]  # doctest: +SKIP
    [('stribeck', True)]
    """

    finding: Finding
    rmse_without: dict[int, float]
    rmse_with: dict[int, float]
    error_drop: float
    p_value: float
    confirmed: bool | None


@dataclass(frozen=True)
class ParquetDiagnosis:
    """A diagnosis of part of a recording, and its confirmation on the rest.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis of the sampled trajectories.
    confirmations : list of Confirmation
        One for each finding.
    model : RBDRegressor
        The given model with all confirmed findings, identified from all trajectories that were not
        used in the search.
    evidence : Evidence
        Evidence of these trajectories, with the columns of all findings.
    trajectories, sampled : int
        Number of all trajectories, and of those used in the search.
    rows : int
        Number of rows of the whole recording.

    Examples
    --------
    >>> result.diagnosis.verdict, result.sampled, result.trajectories  # doctest: +SKIP
    ('missing', 100, 10000)
    """

    diagnosis: Diagnosis
    confirmations: list[Confirmation]
    model: Any
    evidence: Evidence
    trajectories: int
    sampled: int
    rows: int


def diagnose_parquet(
    model: Any,
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    *,
    columns: ColumnMap | None = None,
    sample_rows: int | None = None,
    effects: Iterable[str] | None = None,
    settings: Settings | None = None,
    max_rows: int = 2_000_000,
    random_state: int = 0,
    n_jobs: int | None = None,
    client: Any = None,
) -> ParquetDiagnosis:
    """Diagnose a model with Parquet files that may be larger than memory.

    The search for effects needs the rows again and again, so it is done on trajectories drawn at
    random. Its findings are then tested on all other trajectories in one pass over the files: the
    error of each group, predicted by a model fitted to the others, is compared with and without the
    effect. Memory is that of the sample and the longest trajectory, time is linear in the rows.

    Parameters
    ----------
    model : RBDRegressor
        The model to be judged; its effects with open shape parameters are fitted to the sample.
    paths : path or iterable of path
        Files or a folder, see :func:`skidyn.evidence.evidence_from_parquet`. They need ``time``.
    columns : mapping, optional
        Column of each signal, for columns without the usual names.
    sample_rows : int, optional
        Number of rows used in the search, rounded to whole trajectories: at least four, and at most
        half of all. By default 200,000 divided by the number of joints.
    effects : iterable of str, optional
        Kinds to try; by default the whole catalogue.
    settings : Settings, optional
        Thresholds of the search.
    max_rows : int, default=2_000_000
        Longest trajectory that is read.
    random_state : int, default=0
        Seed of the sample.
    n_jobs : int, optional
        Processes that search the sample and compute the evidence, see :func:`diagnose` and
        :func:`skidyn.evidence.evidence_from_parquet`.
    client : distributed.Client, optional
        Cluster on which to compute it.

    Returns
    -------
    ParquetDiagnosis
        The diagnosis of the sample, the confirmation of its findings on the rest, and the better
        model.

    Raises
    ------
    LogError
        There are fewer than eight trajectories, files have no time, or
        :func:`~skidyn.evidence.evidence_from_parquet` refuses a file.
    SkidynError
        The columns of an effect need a fit of the model first.

    References
    ----------
    D. R. Cox (1975), A note on data-splitting for the evaluation of significance levels,
    Biometrika 62(2), 441-444.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.diagnosis import diagnose_parquet
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(
    ...     load_planar_arm(), "stribeck", joints=[2], n_trajectories=16, rate=100.0
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log.frame.to_parquet(pathlib.Path(folder, "log.parquet"))
    ...     result = diagnose_parquet(
    ...         RBDRegressor(log.robot), folder, effects=["stribeck", "spring"]
    ...     )
    >>> [(c.finding.kind, c.finding.joints, c.confirmed) for c in result.confirmations]
    [('stribeck', (2,), True)]
    """
    robot = model.robot
    refused = [t.kind for t in make_terms(model.effects, robot.n_joints) if t.effect.needs_fit]
    if refused:
        raise SkidynError(
            f"the columns of {refused[0]!r} require a fit of the model first, so one pass is not "
            "enough; leave it out, or diagnose data in memory"
        )
    sample_rows = SAMPLE // robot.n_joints if sample_rows is None else sample_rows
    files = parquet_files(paths)
    lengths = [trajectory_lengths(file, robot, columns) for file in files]
    sources = list(zip(files, _draw(lengths, sample_rows, random_state), strict=True))
    n_sampled = sum(
        int(n[list(drawn)].sum()) for n, (_, drawn) in zip(lengths, sources, strict=True)
    )
    X, tau = _sample(sources, n_sampled, robot, columns, max_rows)
    diagnosis = diagnose(model, X, tau, effects=effects, settings=settings, n_jobs=n_jobs)
    own = own_terms(model, robot, X, tau)
    tried = [f for f in diagnosis.findings if not any(t.effect.needs_fit for t in f.terms)]
    terms = [*own, *(t for f in tried for t in f.terms)]
    options = Options(columns, GROUPS, max_rows)
    evidence = evidence_of_sources(sources, robot, terms, options, n_jobs, client)
    confirmations = [_confirm(f, evidence, f in tried) for f in diagnosis.findings]
    kept = [*own, *(t for c in confirmations if c.confirmed for t in c.finding.terms)]
    names = column_names(robot, base_parameter_index(robot), kept)
    return ParquetDiagnosis(
        diagnosis,
        confirmations,
        regressor_from_evidence(robot, evidence.select(names), kept),
        evidence,
        sum(map(len, lengths)),
        sum(len(drawn) for _, drawn in sources),
        sum(int(n.sum()) for n in lengths),
    )


def _draw(lengths: Sequence[Array], rows: int, seed: int) -> list[frozenset[int]]:
    """Trajectories of every file that are used in the search."""
    every = np.concatenate(lengths)
    n = len(every)
    if n < 2 * FEWEST_TRAJECTORIES:
        raise LogError(
            f"{n} trajectories are too few to use some for the search and the rest for "
            f"evaluation; {2 * FEWEST_TRAJECTORIES} are needed. Split them into more "
            "trajectories, or read them with read_log and use diagnose."
        )
    order = np.random.default_rng(seed).permutation(n)
    wanted = int(np.searchsorted(np.cumsum(every[order]), rows, side="right"))
    drawn = np.sort(order[: int(np.clip(wanted, FEWEST_TRAJECTORIES, n // 2))])
    first = np.cumsum([0, *map(len, lengths)])  # trajectory of every file
    of_files = np.split(drawn, np.searchsorted(drawn, first[1:-1]))
    return [frozenset((k - a).tolist()) for k, a in zip(of_files, first[:-1], strict=True)]


def _sample(
    sources: Sequence[Source], n_rows: int, robot: Robot, columns: ColumnMap | None, max_rows: int
) -> tuple[Any, Array]:
    """The sampled trajectories as a table, and their torque."""
    import pandas as pd

    names: list[str] = []
    sample = np.empty((0, 0))
    done = number = 0
    for source in sources:
        for here, values in _drawn_trajectories(source, robot, columns, max_rows):
            if not names:
                names, sample = here, np.empty((n_rows, len(here)))
            elif names != here:
                raise LogError(
                    f"{source[0]}: has {', '.join(here)}, other files have {', '.join(names)}; "
                    "all need the same columns"
                )
            rows = sample[done : done + len(values)]
            rows[:], rows[:, 1] = values, number
            done, number = done + len(values), number + 1
    n_inputs = len(names) - robot.n_joints
    return pd.DataFrame(sample[:, :n_inputs], columns=names[:n_inputs]), sample[:, n_inputs:]


def _drawn_trajectories(
    source: Source, robot: Robot, columns: ColumnMap | None, max_rows: int
) -> Iterator[tuple[list[str], Array]]:
    """Columns and values of the trajectories drawn from a file, with their numbers there.

    Trajectories are views of decoded blocks with several of them. The values are copied, because a
    view would keep its whole block in memory.
    """
    path, drawn = source
    if not drawn:
        return
    for k, (signals, torque) in enumerate(
        read_trajectories(path, robot, columns=columns, max_rows=max_rows)
    ):
        if k not in drawn:
            continue
        if signals.time is None:
            raise LogError(f"{path}: lacks time, which a diagnosis needs")
        tables = {"q": signals.q, "dq": signals.dq, "temp": signals.temperature, "tau": torque}
        blocks = {name: block for name, block in tables.items() if block is not None}
        names = [f"{name}{j + 1}" for name in blocks for j in range(robot.n_joints)]
        number = np.full(len(torque), k)
        values = np.column_stack([signals.time, number, *blocks.values()])
        yield ["time", "trajectory", *names], values


def _confirm(finding: Finding, evidence: Evidence, tried: bool) -> Confirmation:
    """Held-out error of all groups with and without the columns of a finding."""
    own = set(column_names(None, (), finding.terms)) if tried else set()
    _, noise = weighted_solution(evidence)
    errors = [
        evidence.held_out_error([c for c in evidence.columns if c not in left_out], noise)
        for left_out in (own, set())
    ]
    squared = [
        {key: evidence.counts[key] * value**2 for key, value in error.items()} for error in errors
    ]
    groups = evidence.trajectories
    joints = [j - 1 for j in finding.joints]
    before, after = (
        np.array([sum(part.get((g, j), 0.0) for j in joints) for g in groups]) for part in squared
    )
    drop = float(1 - after.sum() / before.sum()) if before.sum() > 0 else 0.0
    # Ratios, since one long group or one with large errors would dominate differences.
    here = (before > 0) & (after > 0)
    ratio = np.log(before[here] / after[here])
    p = 1.0
    if tried:
        p = float(stats.ttest_1samp(ratio, 0.0, alternative="greater").pvalue)
    without, complete = (_by_joint(part, evidence) for part in squared)
    return Confirmation(finding, without, complete, drop, p, p < LEVEL if tried else None)


def _by_joint(squared: dict[tuple[int, int], float], evidence: Evidence) -> dict[int, float]:
    result = {}
    for joint in evidence.joints:
        keys = [key for key in squared if key[1] == joint]
        rows = sum(evidence.counts[key] for key in keys)
        result[joint + 1] = float(np.sqrt(sum(squared[key] for key in keys) / max(1, rows)))
    return result
