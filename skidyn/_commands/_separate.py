# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn separate``: design the motion that separates a finding from its rival."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from skidyn._commands._arguments import Motion, command, with_report
from skidyn._commands._earlier import earlier_checks
from skidyn._commands._input import read_effects, read_inputs, recorded_options
from skidyn._commands._output import print_json, run_diagnosis, working

if TYPE_CHECKING:
    from skidyn.diagnosis import SeparatingMotion

DESCRIPTION = """\
If a report states that "this data cannot separate it from B", design a motion that separates the
two effects.

  skidyn separate --from report.json --out motion.csv

The motion stays within the limits of the URDF and of the log; it is simulated with each effect as
the truth, and the output states whether both were recognised.
"""


class _Told(NamedTuple):
    """What a report tells of a finding."""

    kind: str
    rivals: tuple[str, ...]


def add_parser(commands: Any) -> None:
    parser = command(
        commands, "separate", run, "design a motion that separates two effects", DESCRIPTION
    )
    with_report(parser)
    parser.add_argument("--out", type=Motion, required=True, metavar="CSV", help="motion to write")
    parser.add_argument("--effect", dest="finding", help="kind of the finding (default: the first)")
    parser.add_argument("--rival", help="the other kind (default: the closest rival)")
    parser.add_argument("--duration", type=float, default=20.0, help="in s (default: %(default)s)")


def run(options: argparse.Namespace) -> None:
    from skidyn._writing import write_text
    from skidyn.diagnosis import findings_to_separate
    from skidyn.effects import list_effects

    options = recorded_options(options)
    told = read_effects(options.report, _told)
    chosen = findings_to_separate(told, options.finding, options.rival)
    # the rivals of a report have no parameters: a search among the effects of the duel finds them
    rivals = [options.rival] if options.rival else [r for f in chosen for r in f.rivals]
    among = {*(f.kind for f in told), *rivals}
    motion = _designed(options, [kind for kind in list_effects() if kind in among])
    write_text(options.out, motion.to_frame().to_csv(index=False))
    path = str(Path(options.out).resolve())
    if options.json:
        names = ("kind", "rival", "joints", "gain", "gain_of_log", "confirmed", "sentence")
        print_json({name: getattr(motion, name) for name in names} | {"csv": path})
        return
    print(motion.sentence)
    print(f"written: {path}")


def _told(entry: Any) -> _Told:
    """A finding of a report, which may be untrusted; unknown kinds are refused."""
    from skidyn.effects import get_effect

    kinds = [entry["kind"], *entry["rivals"]]
    for kind in kinds:
        if kind != "unknown":
            get_effect(kind)
    return _Told(kinds[0], tuple(kinds[1:]))


def _designed(options: argparse.Namespace, kinds: Sequence[str]) -> SeparatingMotion:
    """The motion, from a diagnosis with some kinds of effects.

    Beside fewer kinds, a weak finding may be another one; then the whole search is repeated.
    """
    from skidyn._exceptions import EffectError
    from skidyn.diagnosis import design_separating_motion

    # a diagnosis checks the log
    _, model, frame, tau, _ = read_inputs(options, check=False)
    checks = earlier_checks(options)

    def designed(among: Sequence[str] | None) -> SeparatingMotion:
        diagnosis = run_diagnosis(model, frame, tau, options, kinds=among, checks=checks)
        with working("Designing the motion", options):
            return design_separating_motion(
                diagnosis, options.finding, options.rival, duration=options.duration
            )

    try:
        return designed(kinds)
    except EffectError:
        return designed(None)
