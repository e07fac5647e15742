# SPDX-License-Identifier: BSD-3-Clause
"""Power: share of right answers against the size of an effect and the length of the log.

    python benchmarks/diagnosis/power.py [--jobs 2] [--picture power.png]
    python benchmarks/diagnosis/power.py --table TEXT --picture power.png

The second command plots the table that the first has printed; TEXT may be the page of the user
guide with this table, docs/user_guide/diagnosis_measured.rst.

The size is the root mean square of the effect's torque over the noise of the torque sensor, on the
joint that has it; for hysteresis, which replaces Coulomb friction, it is its largest torque. An
answer is right if it identifies the effect (any member for the hysteresis family) on that joint and
nothing else.
"""

from __future__ import annotations

import argparse
import itertools
import re
import warnings
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

ROBOTS = {"planar arm": (load_planar_arm, 2), "ur5": (load_ur5, 3)}
KINDS = (
    "stribeck",
    "load_dependent_friction",
    "dahl",
    "spring",
    "asymmetric_friction",
    "temperature_friction",
)
SIZES = (0.02, 0.05, 0.1, 0.2, 0.5)
LENGTHS = (4, 10)  # trajectories of 10 s
SEEDS = 2
HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}
#: Sizes in units of the noise are gathered in these bins.
BINS = (0.0, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 10.0)

#: Share of right answers and number of logs; None where there is none.
Cell = tuple[float, int] | None
#: Cells of the bins, by kind and number of trajectories.
Table = dict[tuple[str, int], list[Cell]]


def answer(kind: str, size: float, length: int, robot: str, seed: int) -> tuple[float, bool]:
    """Size of the effect in units of the noise, and whether the diagnosis is right."""
    warnings.simplefilter("ignore")
    load, joint = ROBOTS[robot]
    options = {"noise": "high", "n_trajectories": length, "random_state": 300 + seed}
    log = make_hidden_effect_log(load(), kind, joints=[joint], magnitude=size, **options)
    none = make_hidden_effect_log(load(), None, **options)
    own = np.asarray(log.y)[:, joint - 1] - np.asarray(none.y)[:, joint - 1]
    found = [(f.kind, f.joints) for f in diagnose(RBDRegressor(log.robot), log.X, log.y).findings]
    names = HYSTERESIS if kind in HYSTERESIS else {kind}
    right = len(found) == 1 and found[0][0] in names and found[0][1] == (joint,)
    rms = np.ravel(log.parameters["Fc"])[0] if kind in HYSTERESIS else np.sqrt(np.mean(own**2))
    return float(rms / log.noise_std[joint - 1]), right


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--picture", help="draw the curves")
    parser.add_argument("--table", help="a text that holds a table printed earlier; nothing is run")
    options = parser.parse_args()
    if options.table:
        table = read(Path(options.table).read_text("utf-8"))
    else:
        table = measure(options.jobs)
        print(text(table))
    if options.picture:
        draw(table, options.picture)


def measure(jobs: int) -> Table:
    """Diagnose all logs."""
    cases = list(itertools.product(KINDS, SIZES, LENGTHS, ROBOTS, range(SEEDS)))
    results = Parallel(n_jobs=jobs)(delayed(answer)(*case) for case in cases)
    rights: dict[tuple[str, int], list[list[bool]]] = {}
    for (kind, _, length, _, _), (size, right) in zip(cases, results, strict=True):
        row = rights.setdefault((kind, length), [[] for _ in BINS[1:]])
        row[int(np.searchsorted(BINS, size, side="right")) - 1].append(right)
    return {
        key: [(float(np.mean(c)), len(c)) if c else None for c in row]
        for key, row in rights.items()
    }


def text(table: Table) -> str:
    """Table as reStructuredText, without the bins that no log falls into."""
    used = [k for k in range(len(BINS) - 1) if any(row[k] for row in table.values())]
    heads = [f"{a:g}-{b:g}" for a, b in itertools.pairwise(BINS)]
    rows = [["effect", "s", *(heads[k] for k in used)]]
    for (kind, length), row in table.items():
        cells = [f"{c[0]:.2g} ({c[1]})" if (c := row[k]) else "" for k in used]
        rows.append([kind, str(10 * length), *cells])
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    rule = "  ".join("=" * width for width in widths)
    lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join([rule, lines[0], rule, *lines[1:], rule])


def read(source: str) -> Table:
    """The table among other text: columns start where the rule's do."""
    lines = source.splitlines()
    start = next(k for k, line in enumerate(lines) if re.match(r"effect +s ", line)) - 1
    columns = [m.span() for m in re.finditer("=+", lines[start])]

    def cells(line: str) -> list[str]:
        ends = [begin for begin, _ in columns[1:]] + [None]
        return [line[a:b].strip() for (a, _), b in zip(columns, ends, strict=True)]

    lows = [float(re.findall(r"[\d.]+", head)[0]) for head in cells(lines[start + 1])[2:]]
    table: Table = {}
    for line in itertools.takewhile(lambda li: not li.startswith("="), lines[start + 3 :]):
        kind, length, *shares = cells(line)
        row: list[Cell] = [None] * (len(BINS) - 1)
        for low, share in zip(lows, shares, strict=True):
            if share:
                right, logs = re.fullmatch(r"([\d.]+) \((\d+)\)", share).groups()
                row[BINS.index(low)] = (float(right), int(logs))
        table[kind.replace(" ", "_").replace("-", "_"), int(length) // 10] = row
    return table


def draw(table: Table, path: str) -> None:
    """Curves of one panel an effect."""
    import matplotlib.pyplot as plt

    middle = np.sqrt(np.maximum(BINS[:-1], 0.01) * np.array((*BINS[1:-1], 3.0)))
    figure, axes = plt.subplots(2, 3, figsize=(9, 5), sharex=True, sharey=True)
    # the colours of Okabe and Ito, and two marks: for every eye and every printer
    styles = ((LENGTHS[0], "--o", "#d55e00"), (LENGTHS[1], "-s", "#0072b2"))
    for axis, kind in zip(axes.flat, KINDS, strict=True):
        for length, mark, colour in styles:
            share = np.array([c[0] if c else np.nan for c in table[kind, length]])
            seen = np.isfinite(share)
            axis.plot(middle[seen], share[seen], mark, color=colour, label=f"{10 * length} s")
        axis.set_title(kind.replace("_", " "), fontsize=11)
        axis.set_xscale("log")
        axis.set_xticks([0.05, 0.1, 0.2, 0.5, 1, 2], ["0.05", "0.1", "0.2", "0.5", "1", "2"])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    lines = axes[0, 0].get_legend_handles_labels()
    figure.legend(*lines, loc="lower right", ncols=2, frameon=False)  # clear of every curve
    figure.supxlabel("size of the effect over the noise (root mean squares)")
    figure.supylabel("share of right answers")
    figure.tight_layout()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
