# SPDX-License-Identifier: BSD-3-Clause
"""How sure a name is: fit the weights on one folder of answers, print the reliability on others.

    python benchmarks/diagnosis/confidence.py TRUTH.json REPORTS [TRUTH.json REPORTS ...]

``REPORTS`` holds one ``report.json`` a log, as ``skidyn diagnose --out`` writes it, named after its
case. The first pair is for the weights, all of them are for the table.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from sklearn.linear_model import LogisticRegression

from skidyn.diagnosis._confidence import confidence

BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 1.0)


def names(truth: Path, reports: Path) -> list[tuple[float, float, bool]]:
    """Margin, what is left over the noise, and whether the name is right, of every finding."""
    cases = json.loads(truth.read_text())
    table = {t["case"]: t for t in (cases.values() if isinstance(cases, dict) else cases)}
    rows = []
    for file in sorted(reports.glob("*.json")):
        if file.stem not in table:
            continue
        report, hidden = json.loads(file.read_text()), table[file.stem]
        ratio = np.array(report["rmse_after"]) / np.maximum(report["noise_floor"], 1e-300)
        true = [*hidden["effects"], *hidden.get("nuisance", [])]
        for effect in report["effects"]:
            if effect["when"]:  # no name: it comes and goes
                continue
            right = any(
                effect["kind"] in {e["kind"], *e.get("accept", [])}
                and (not e["joints"] or set(effect["joints"]) & set(e["joints"]))
                for e in true
            )
            left = float(ratio[[j - 1 for j in effect["joints"]]].max())
            rows.append((effect["margin"], left, right))
    return rows


def main() -> None:
    paths = [Path(p) for p in sys.argv[1:]]
    pairs = list(zip(paths[::2], paths[1::2], strict=True))
    first = names(*pairs[0])
    x = np.array([[min(max(m, 0.0), 1.0), np.log(max(r, 1.0))] for m, r, _ in first])
    right = np.array([ok for _, _, ok in first])
    if len(set(right)) == 2:
        fit = LogisticRegression(C=10.0).fit(x, right)
        weights = (*fit.intercept_, *fit.coef_[0])
        print("weights (constant, margin, left):", ", ".join(f"{w:.2f}" for w in weights))
    for truth, reports in pairs:
        rows = names(truth, reports)
        p = np.array([confidence(m, r) for m, r, _ in rows])
        ok = np.array([good for _, _, good in rows])
        print(f"{reports}: {len(rows)} names, {ok.mean():.3f} right")
        for low, high in zip(BINS[:-1], BINS[1:], strict=True):
            here = (p >= low) & (p < high)
            if here.any():
                print(f"  stated {p[here].mean():.2f}: {ok[here].mean():.2f} of {here.sum()}")


if __name__ == "__main__":
    main()
