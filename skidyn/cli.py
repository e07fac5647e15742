# SPDX-License-Identifier: BSD-3-Clause
"""The command line: ``skidyn COMMAND --help`` teaches each command."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from skidyn._exceptions import LogWarning, SkidynError

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.diagnosis import Comparison, Diagnosis
    from skidyn.rigid_body import RBDRegressor
    from skidyn.robots import Robot

#: Exit codes: done; the input is at fault; stopped by the user.
DONE, BAD_INPUT, STOPPED = 0, 2, 130

_DIAGNOSE = """\
Compare a model with a log and learn which physical effect it lacks.

  skidyn diagnose run1.csv run2.csv --urdf robot.urdf --out report.json --html report.html

LOG is a table with the columns time, trajectory, q1.., dq1.., tau1.. (optional ddq1.., temp1..);
other names through --columns '{"q": ["pos_a", "pos_b"]}'. --model says what the model has already:
rigid_body and kinds of the catalogue (skidyn effects lists them).
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after ``skidyn``; those of the process by default.

    Returns
    -------
    int
        Exit code: 0 done, 2 the input is at fault, 130 stopped by Ctrl-C.

    Examples
    --------
    >>> main(["effects", "--json"])  # doctest: +ELLIPSIS
    {...
    0
    """
    parser = _parser()
    options = parser.parse_args(arguments)
    if not hasattr(options, "run"):
        parser.print_help()
        return BAD_INPUT
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                options.run(options)
            finally:  # what is odd about a log often explains why it was refused
                for text in dict.fromkeys(str(w.message) for w in caught if _is_ours(w)):
                    print(f"warning: {text}", file=sys.stderr)
    except BrokenPipeError:  # the reader, such as head, has seen enough
        # what is still buffered must not raise again when Python shuts down
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (SkidynError, OSError, ImportError) as error:
        print(f"skidyn {options.command}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("stopped; no file was left half written", file=sys.stderr)
        return STOPPED
    return DONE


def _is_ours(caught: warnings.WarningMessage) -> bool:
    return issubclass(caught.category, LogWarning)


# ---------------------------------------------------------------------------- words
def _parser() -> argparse.ArgumentParser:
    from skidyn import __version__

    parser = argparse.ArgumentParser(
        prog="skidyn",
        description="Robot inverse dynamics: compare a model with measurements, see where it "
        "fails, learn what is missing, add it and watch the error fall.",
    )
    parser.add_argument("--version", action="version", version=f"skidyn {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    _add_diagnose(commands)
    _add_compare(commands)
    _add_identify(commands)
    _add_add(commands)
    _add_report(commands)
    _add_simulate(commands)
    _add_demo(commands)
    _add_effects(commands)
    return parser


def _command(commands: Any, name: str, run: Any, text: str, description: str = "") -> Any:
    parser = commands.add_parser(
        name,
        help=text,
        description=description or text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    return parser


def _with_log(parser: Any) -> None:
    parser.add_argument("logs", nargs="+", metavar="LOG", help="recordings, one or more files")
    parser.add_argument("--urdf", required=True, help="description of the robot")
    parser.add_argument(
        "--model",
        default="rigid_body,viscous,coulomb",
        help="what the model has, separated by commas (default: %(default)s)",
    )
    parser.add_argument(
        "--nominal",
        action="store_true",
        help="keep the inertial parameters of the URDF instead of identifying them",
    )
    parser.add_argument("--columns", help="JSON object: which columns hold which signals")
    parser.add_argument("--units", help='JSON object: units that are not SI, {"q": "deg"}')
    parser.add_argument("--drive-gains", help="JSON list: torque per ampere, for logs of currents")
    parser.add_argument("--joints", help="joints the log covers, separated by commas")
    parser.add_argument("--rate", type=float, help="sampling rate in Hz of a log without time")


def _add_diagnose(commands: Any) -> None:
    parser = _command(commands, "diagnose", _diagnose, "learn which effect is missing", _DIAGNOSE)
    _with_log(parser)
    parser.add_argument("--out", metavar="JSON", help="write the report as JSON")
    parser.add_argument("--html", metavar="HTML", help="write the report as a page")
    parser.add_argument("--effects", help="kinds to try, separated by commas (default: all)")


def _with_joints(parser: Any, text: str) -> None:
    # not `joints`: that is the option of the log, which a report records
    parser.add_argument(
        "--joints", "--on", dest="on", metavar="1,4", help=f"{text}, counted from 1"
    )


def _add_compare(commands: Any) -> None:
    parser = _command(
        commands, "compare", _compare, "print the held-out error by joint, trajectory and regime"
    )
    _with_log(parser)


def _add_identify(commands: Any) -> None:
    parser = _command(commands, "identify", _identify, "identify parameters and print them")
    _with_log(parser)
    parser.add_argument("--out", metavar="JSON", help="write the parameters as JSON")
    parser.add_argument("--consistent", action="store_true", help="only bodies that can exist")


def _add_add(commands: Any) -> None:
    parser = _command(
        commands,
        "add",
        _add,
        "add an effect to a diagnosed model and print the error before, after",
    )
    parser.add_argument("--from", dest="report", required=True, help="report.json of diagnose")
    parser.add_argument("--effect", required=True, help="kind of the catalogue")
    _with_joints(parser, "joints that get the effect (default: all)")
    parser.add_argument("--out", metavar="JSON", help="write the parameters of the better model")


def _add_report(commands: Any) -> None:
    parser = _command(commands, "report", _report, "turn the log of a report.json into a page")
    parser.add_argument("--from", dest="report", required=True, help="report.json of diagnose")
    parser.add_argument("--html", required=True, help="page to write")


def _add_simulate(commands: Any) -> None:
    parser = _command(commands, "simulate", _simulate, "write a log that hides an effect")
    parser.add_argument("--robot", default="panda", help="embedded robot (default: %(default)s)")
    parser.add_argument("--effect", default="dahl", help="kind, or none (default: %(default)s)")
    _with_joints(parser, "joints that have the effect (default: a suitable choice)")
    parser.add_argument("--noise", default="low", choices=("low", "high"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", required=True, metavar="LOG", help="file.csv or file.parquet")


def _add_demo(commands: Any) -> None:
    parser = _command(commands, "demo", _demo, "the whole loop on a simulated log")
    parser.add_argument("--html", default="skidyn-demo.html", help="page to write")


def _add_effects(commands: Any) -> None:
    _command(commands, "effects", _effects, "list the catalogue of effects")


# ---------------------------------------------------------------------------- commands
def _diagnose(options: argparse.Namespace) -> None:
    model, frame, tau = _load(options)
    diagnosis = _run_diagnosis(model, frame, tau, options)
    _write_reports(diagnosis, options.out, options.html, _provenance(options))
    if options.json:
        _print_json(diagnosis.to_dict())
    else:
        _print_diagnosis(diagnosis)
        for path in filter(None, (options.out, options.html)):
            print(f"written: {Path(path).resolve()}")


def _compare(options: argparse.Namespace) -> None:
    model, frame, tau = _load(options)
    diagnosis = _run_diagnosis(model, frame, tau, options, kinds=())
    comparison = diagnosis.comparison
    if options.json:
        _print_json(
            {"table": comparison.table(), "failures": [vars(f) for f in diagnosis.failures]}
        )
        return
    _print_comparison(comparison)
    _print_regimes(diagnosis)


def _identify(options: argparse.Namespace) -> None:
    model, frame, tau = _load(options)
    model.set_params(consistent=options.consistent)
    with _working("Identifying", options):
        model.fit(frame, tau)
    content = _parameters(model)
    if options.out:
        _write_json(options.out, content)
    if options.json:
        _print_json(content)
        return
    for row in model.parameter_table():
        print(f"{row['value']:12.5g} ± {row['std']:9.2g}   {row['name']}")


def _add(options: argparse.Namespace) -> None:
    from skidyn.effects import make_terms

    options = _recorded(options)
    model, frame, tau = _load(options)
    robot = _robot(options)
    joints = _numbers(options.on)
    spec = options.effect if joints is None else (options.effect, joints)
    terms = make_terms([spec], robot.n_joints)
    before = _run_diagnosis(model, frame, tau, options, kinds=()).rmse_before
    fitted = model.with_effects(terms).fit(frame, tau)
    better = model.with_effects(fitted.effect_terms_[-len(terms) :])
    after = _run_diagnosis(better, frame, tau, options, kinds=()).rmse_before
    if options.out:
        _write_json(options.out, _parameters(fitted))
    if options.json:
        _print_json({"before": before.tolist(), "after": after.tolist()})
        return
    print(f"held-out error with {options.effect} added (N m, N for sliders; sliding samples)")
    for j, name in enumerate(robot.joint_names):
        change = after[j] / before[j] - 1 if before[j] > 0 else 0.0
        print(f"  {name:24s} {before[j]:9.4g} -> {after[j]:9.4g}  ({change:+.0%})")


def _report(options: argparse.Namespace) -> None:
    options = _recorded(options)
    model, frame, tau = _load(options)
    diagnosis = _run_diagnosis(model, frame, tau, options)
    _write_reports(diagnosis, None, options.html, _provenance(options))
    page = str(Path(options.html).resolve())
    if options.json:
        _print_json({"html": page})
    else:
        print(f"written: {page}")


def _simulate(options: argparse.Namespace) -> None:
    from skidyn.datasets import make_hidden_effect_log

    if Path(options.out).suffix not in (".csv", ".parquet"):
        raise SkidynError(f"{options.out}: the log to write must end in .csv or .parquet")
    robot = _embedded(options.robot)
    effect = None if options.effect == "none" else options.effect
    with _working("Simulating", options):
        log = make_hidden_effect_log(
            robot,
            effect,
            joints=_numbers(options.on),
            noise=options.noise,
            random_state=options.seed,
        )
    _write_table(log.frame, options.out)
    truth = {"effect": log.effect, "joints": list(log.joints), "parameters": log.parameters}
    if options.json:
        _print_json(truth)
    else:
        print(f"{len(log.frame)} samples written: {Path(options.out).resolve()}")
        print(f"hidden: {truth}")


def _demo(options: argparse.Namespace) -> None:
    from skidyn.datasets import load_demo_log
    from skidyn.diagnosis import diagnose
    from skidyn.rigid_body import RBDRegressor

    say = (lambda *words: None) if options.json else print
    say("1. A Panda arm is simulated with two effects that no model below knows of. Two of its")
    say("   trajectories are put aside: nothing is fitted to them.")
    log = load_demo_log()
    aside = log.X["trajectory"] >= log.X["trajectory"].max() - 1
    X, y, X_new, y_new = log.X[~aside], log.y[~aside], log.X[aside], log.y[aside]
    model = RBDRegressor(log.robot)
    say("2. The model: rigid body, viscous and Coulomb friction. Where does it fail?")
    with _working("Searching for what is missing", options):
        diagnosis = diagnose(model, X, y)
    for failure in diagnosis.failures[:3]:
        say(f"   {failure.sentence}")
    say("3. What is missing?")
    for finding in diagnosis.findings:
        say(f"   {finding.sentence}")
    say("4. Added and fitted again; error on the trajectories put aside (N m, whole motion):")
    before = _errors(model.fit(X, y), X_new, y_new)
    after = _errors(diagnosis.model, X_new, y_new)
    for name, a, b in zip(log.robot.joint_names, before, after, strict=True):
        say(f"   {name:22s} {a:8.4f} -> {b:8.4f}  ({b / a - 1:+.0%})")
    _write_reports(diagnosis, None, options.html, {"log": "simulated by skidyn demo"})
    page = str(Path(options.html).resolve())
    if options.json:
        kinds = [finding.kind for finding in diagnosis.findings]
        _print_json({"found": kinds, "before": before, "after": after, "html": page})
    say(f"5. The report: {page}")


def _effects(options: argparse.Namespace) -> None:
    from skidyn.effects import get_effect, list_effects

    catalogue = {kind: get_effect(kind).describe() for kind in list_effects()}
    if options.json:
        _print_json(catalogue)
        return
    for kind, entry in catalogue.items():
        print(f"{kind:28s} {entry['title']}")


# ---------------------------------------------------------------------------- input
def _load(options: argparse.Namespace) -> tuple[RBDRegressor, pd.DataFrame, Any]:
    from skidyn.datasets import read_log
    from skidyn.rigid_body import RBDRegressor

    robot = _robot(options)
    frame = read_log(
        list(options.logs),
        robot=robot,
        columns=_json_option("columns", options.columns),
        units=_json_option("units", options.units),
        drive_gains=_json_option("drive-gains", getattr(options, "drive_gains", None)),
        rate=options.rate,
    )
    tau = frame[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy()
    kinds = [kind.strip() for kind in options.model.split(",") if kind.strip()]
    if "rigid_body" not in kinds:
        raise SkidynError("--model must contain rigid_body; it may add kinds of the catalogue")
    effects = tuple(kind for kind in kinds if kind != "rigid_body")
    model = RBDRegressor(robot, effects, "nominal" if options.nominal else "identified")
    return model, frame, tau


def _robot(options: argparse.Namespace) -> Robot:
    from skidyn.robots import Robot

    path = Path(options.urdf)
    if not path.is_file():
        raise SkidynError(f"no file {options.urdf}; --urdf wants the description of the robot")
    joints = options.joints.split(",") if options.joints else None
    return Robot.from_urdf(path, joints=joints)


def _embedded(name: str) -> Robot:
    from skidyn import datasets

    loader = getattr(datasets, f"load_{name}", None)
    if loader is None or name in ("recording", "demo_log"):
        known = sorted(
            n.removeprefix("load_")
            for n in datasets.__all__
            if n.startswith("load_") and n not in ("load_recording", "load_demo_log")
        )
        raise SkidynError(f"no embedded robot {name!r}; there are {', '.join(known)}")
    return loader()


def _json_option(name: str, text: str | None) -> Any:
    if text is None:
        return None
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise SkidynError(f"--{name} is not JSON: {error}") from None


def _numbers(text: str | None) -> list[int] | None:
    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise SkidynError(f"{text!r}: joints are numbers from 1, such as 1,4") from None


def _recorded(options: argparse.Namespace) -> argparse.Namespace:
    """Options of the diagnosis that a report records, with those of this command."""
    try:
        report = json.loads(Path(options.report).read_text(encoding="utf-8"))
    except ValueError as error:
        raise SkidynError(f"{options.report} is not a report of skidyn diagnose: {error}") from None
    provenance = report.get("provenance") if isinstance(report, dict) else None
    provenance = provenance if isinstance(provenance, dict) else {}
    recorded = provenance.get("options")
    if not isinstance(recorded, dict) or "logs" not in recorded:
        raise SkidynError(f"{options.report} records no log; it must come from skidyn diagnose")
    for name, digest in _hashes([*recorded["logs"], recorded["urdf"]]).items():
        if digest != provenance.get("sha256", {}).get(name):
            warnings.warn(
                f"{name} has changed since {options.report} was written", LogWarning, stacklevel=2
            )
    return argparse.Namespace(**{**recorded, **vars(options)})


# ---------------------------------------------------------------------------- output
def _run_diagnosis(
    model: Any, frame: Any, tau: Any, options: argparse.Namespace, kinds: Any = None
) -> Diagnosis:
    from skidyn.diagnosis import Settings, diagnose

    wanted = getattr(options, "effects", None)
    if kinds is None and wanted:
        kinds = [kind.strip() for kind in wanted.split(",")]
    # Without kinds nothing is searched: the model is only compared.
    settings = Settings(max_findings=0) if kinds == () else Settings()
    rate = getattr(options, "rate", None)
    with _working("Comparing" if kinds == () else "Searching for what is missing", options):
        return diagnose(model, frame, tau, effects=kinds, rate=rate, settings=settings)


def _write_reports(
    diagnosis: Diagnosis, out: str | None, html: str | None, provenance: dict[str, Any]
) -> None:
    if out:
        _write_json(out, {**diagnosis.to_dict(), "provenance": provenance})
    if html:
        from skidyn.report import summarize, write_html

        write_html(html, summarize(diagnosis, provenance=provenance))


def _write_json(path: str, content: dict[str, Any]) -> None:
    from skidyn.report import write_json

    write_json(path, content)


def _write_table(frame: pd.DataFrame, path: str) -> None:
    """Write a log in one step: an interrupted run leaves the previous file whole."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    write = frame.to_parquet if target.suffix == ".parquet" else frame.to_csv
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".skidyn-") as folder:
        part = Path(folder, target.name)
        write(part, index=False)
        os.replace(part, target)


@contextmanager
def _working(text: str, options: argparse.Namespace) -> Iterator[None]:
    """Show that long work goes on, where a person looks and rich is installed."""
    if getattr(options, "json", False) or not sys.stderr.isatty():
        yield
        return
    try:
        from rich.console import Console
    except ImportError:
        print(f"{text} ...", file=sys.stderr)
        yield
        return
    with Console(stderr=True).status(text):
        yield


def _provenance(options: argparse.Namespace) -> dict[str, Any]:
    from skidyn._version import versions

    # the path of the interpreter says nothing about the numbers, but much about its user
    used = {name: version for name, version in versions().items() if name != "executable"}
    keep = (
        *("logs", "urdf", "model", "nominal", "columns", "units", "drive_gains", "joints"),
        *("rate", "effects"),
    )
    recorded = {k: getattr(options, k, None) for k in keep}
    hashes = _hashes([*options.logs, options.urdf])
    return {"versions": used, "sha256": hashes, "options": recorded}


def _hashes(files: Sequence[str]) -> dict[str, str]:
    """SHA-256 of every file that is there."""
    import hashlib

    hashes = {}
    for name in files:
        if Path(name).is_file():
            with open(name, "rb") as file:
                hashes[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return hashes


def _parameters(model: RBDRegressor) -> dict[str, Any]:
    return {
        "schema": "skidyn.parameters/1",
        "joints": list(model.robot_.joint_names),
        "coefficients": model.parameter_table(),
        "base_parameters": model.base_parameters_,
        "inertial_parameters": model.inertial_parameters_.tolist(),
        "effects": [
            {
                "kind": term.kind,
                "joints": [j + 1 for j in term.joints],
                "shape": dict(term.shape),
                "coefficients": model.effect_coefficients_[term].tolist(),
            }
            for term in model.effect_terms_
        ],
        "noise_std": model.noise_std_.tolist(),
    }


def _errors(model: Any, X: Any, y: Any) -> Any:
    import numpy as np

    return np.sqrt(np.mean((np.asarray(model.predict(X)) - np.asarray(y)) ** 2, axis=0))


def _print_json(content: Any) -> None:
    from skidyn.report._plain import plain

    print(json.dumps(plain(content), indent=2))


def _print_diagnosis(diagnosis: Diagnosis) -> None:
    verdicts = {
        "complete": "Nothing significant is missing.",
        "missing": "Something is missing, and it has a name.",
        "unknown": "Something is missing that no named effect explains.",
    }
    print(verdicts[diagnosis.verdict])
    for note in diagnosis.warnings:
        print(f"  note: {note}")
    for finding in diagnosis.findings:
        print(f"  {finding.sentence}")
        print(f"      {finding.code}")
    print("held-out error on sliding samples (N m, N for sliders): before, after, noise floor")
    rows = zip(
        diagnosis.joint_names,
        diagnosis.rmse_before,
        diagnosis.rmse_after,
        diagnosis.noise_floor,
        strict=True,
    )
    for name, before, after, floor in rows:
        print(f"  {name:24s} {before:9.4g} {after:9.4g} {floor:9.4g}")
    for failure in diagnosis.failures[:3]:
        print(f"  {failure.sentence}")


def _print_comparison(comparison: Comparison) -> None:
    print("held-out error by joint and trajectory: rmse (N m, N for sliders), share of the torque")
    for row in comparison.table():
        print(
            f"  {row['name']:24s} trajectory {row['trajectory']:4d} "
            f"{row['rmse']:9.4g}  {row['relative']:6.1%}"
        )


def _print_regimes(diagnosis: Diagnosis) -> None:
    import numpy as np

    print("by joint and regime (N m, N for sliders)")
    print(" " * 26 + "".join(f"{name:>10s}" for name in diagnosis.regimes))
    for name, errors in zip(diagnosis.joint_names, diagnosis.error_map(), strict=True):
        cells = "".join("         -" if np.isnan(e) else f"{e:10.4g}" for e in errors)
        print(f"  {name:24s}{cells}")
    for failure in diagnosis.failures:
        print(f"  {failure.sentence}")


if __name__ == "__main__":
    sys.exit(main())
