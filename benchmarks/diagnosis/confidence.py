# SPDX-License-Identifier: BSD-3-Clause
"""Reliability of the stated confidence of findings, and weights fitted to it.

    python benchmarks/diagnosis/confidence.py TRUTH REPORTS [TRUTH REPORTS ...]

``TRUTH`` is a file with the truths of all logs, or a folder with one file for each; ``REPORTS``
contains one report per log, written by ``practice.py --reports`` and named after its case. An
effect on several joints counts once.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from sklearn.linear_model import LogisticRegression

from skidyn.diagnosis._confidence import COLOURED, ENOUGH, LEAST, STRONG

BINS = (0.0, 0.6, 0.75, 0.85, 0.9, 0.95, 1.0)
#: These act on the tool or the base: any joint is right.
ANYWHERE = {"payload", "external_wrench", "base_tilt", "environment_contact"}


def right(effect: dict, hidden: dict) -> bool:
    """Whether a name is that of a hidden effect on one of its joints."""
    true = [*hidden["effects"], *hidden.get("nuisance", [])]
    for e in true:
        lacks = e["kind"] in ("viscous", "coulomb") and e["kind"] not in hidden["base_model"]
        anywhere = lacks or e["kind"] in ANYWHERE or not e["joints"]
        if effect["kind"] in {e["kind"], *e.get("accept", [])}:
            if anywhere or set(effect["joints"]) & set(e["joints"]):
                return True
    return False


def truths(path: Path) -> dict[str, dict]:
    """What is hidden in every log, by its name."""
    if path.is_dir():
        return {file.stem: json.loads(file.read_text()) for file in path.glob("*_*.json")}
    cases = json.loads(path.read_text())
    return {t["case"]: t for t in (cases.values() if isinstance(cases, dict) else cases)}


def names(truth: Path, reports: Path) -> list[tuple[float, bool, list[float]]]:
    """Stated probability, whether the name is right, and what tells, of every name."""
    table = truths(truth)
    rows = []
    for file in sorted(reports.glob("*.json")):
        if file.stem not in table:
            continue
        report, seen = json.loads(file.read_text()), set()
        inflation = np.array(report["remainder_inflation"])
        nameless = {j for e in report["effects"] if e["kind"] == "unknown" for j in e["joints"]}
        nameless |= set((report["unexplained"] or {"joints": []})["joints"])
        for effect in report["effects"]:
            if effect["confidence"] is None or effect["kind"] in seen:
                continue
            seen.add(effect["kind"])
            alike = [e for e in report["effects"] if e["kind"] == effect["kind"]]
            joints = {j for e in alike for j in e["joints"]}
            slow = inflation[[j - 1 for j in joints]].max()
            drop = max(e["error_drop"] for e in alike)
            chance = min(e["q_value"] or 0.0 for e in alike)
            tells = [
                min(max(effect["margin"], 0.0), 1.0),
                np.log(max(slow / COLOURED, 1.0)),
                np.log10(min(max(drop, LEAST), ENOUGH) / ENOUGH),
                float(bool(nameless & joints)),
                np.log10(max(chance / STRONG, 1.0)),
            ]
            rows.append((effect["confidence"], right(effect, table[file.stem]), tells))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "paths", nargs="+", type=Path, metavar="TRUTH REPORTS", help="any number of pairs"
    )
    paths = parser.parse_args().paths
    if len(paths) % 2:
        parser.error(f"expected pairs of truths and reports, got {len(paths)} paths")
    rows = []
    for truth, reports in zip(paths[::2], paths[1::2], strict=True):
        rows += names(truth, reports)
    stated, good = np.array([p for p, _, _ in rows]), np.array([ok for _, ok, _ in rows])
    print(f"{len(rows)} names, {good.sum()} right")
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        here = (stated >= low) & (stated < high)
        if here.any():
            print(
                f"  stated {low:.2f} to {high:.2f}, {stated[here].mean():.2f} on average: "
                f"{good[here].mean():.2f} right of {here.sum()}"
            )
    sure = stated >= 0.9
    print(f"  stated 0.9 or more: {np.sum(~good[sure])} wrong of {sure.sum()}")
    if 0 < good.sum() < len(good):
        fit = LogisticRegression(C=3.0).fit(np.array([t for _, _, t in rows]), good)
        weights = ", ".join(f"{w:.2f}" for w in (*fit.intercept_, *fit.coef_[0]))
        print(
            "weights (constant, margin, correlated, removed, nameless beside it, weak) of these: "
            f"{weights}"
        )


if __name__ == "__main__":
    main()
