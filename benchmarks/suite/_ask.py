# SPDX-License-Identifier: BSD-3-Clause
"""Answers of one peer to many cases, in the peer's environment.

    python _ask.py PEER.py {answers,errors} SECONDS CASE ...

``answers`` uses whole logs; ``errors`` needs a second fit without the last two trajectories.
"""

from __future__ import annotations

import contextlib
import io
import json
import signal
import sys
import time
import warnings
from importlib.metadata import version
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
from _log import Log, read


def load(file: Path):
    """Module of a peer."""
    spec = spec_from_file_location(file.stem, file)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def held_out_error(fitted: dict, test: Log) -> float:
    """Ratio of the held-out error to the base model's, root mean square over joints."""
    said = fitted["predict"](test)
    ratios = [
        np.mean((r.torque - s) ** 2) / np.mean(r.torque**2)
        for r, s in zip(test.joints, said, strict=True)
    ]
    return float(np.sqrt(np.mean(ratios)))


def ask(peer, case: Path, seconds: float) -> dict:
    """The peer's answer to the whole log; ``error_held_out`` is null where it can be measured.

    The answer of a peer that fails or takes more than ``seconds`` of processor time is that nothing
    is missing, with the reason.
    """
    whole, _, _ = read(case)
    said = {"case": case.name, "verdict": "complete", "effects": []}
    said["version"] = f"{peer.PACKAGE} {version(peer.PACKAGE)}"
    start = time.process_time()
    try:
        with _limit(seconds):
            said |= peer.answer(whole, whole.urdf)
    except Exception as error:  # a failure of a peer must not end the comparison
        said["fault"] = f"{type(error).__name__}: {error}"
    said.pop("model", None)  # of the whole log
    if said.pop("predict", None) is not None:
        said["error_held_out"] = None
    return said | {"seconds": time.process_time() - start}


def judge(peer, case: Path, out: Path, seconds: float) -> dict:
    """Add the error on held-out trajectories to the answer in a file, unless the peer failed."""
    said = json.loads(out.read_text())
    _, train, test = read(case)
    start = time.process_time()
    try:
        with _limit(seconds):
            fitted = peer.answer(train, train.urdf)
            said["error_held_out"] = held_out_error(fitted, test)
        keep_model(fitted.get("model"), case.parents[1] / "models" / peer.__name__ / case.name)
    except Exception as error:  # a failure of a peer must not end the comparison
        del said["error_held_out"]
        said["fault_again"] = f"{type(error).__name__}: {error}"
    return said | {"seconds_again": time.process_time() - start}


def keep_model(model, name: Path) -> None:
    """Keep the model of an answer for its simulation: numbers as JSON, or a model of skidyn."""
    if model is None:
        return
    name.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(model, dict):
        name.with_suffix(".json").write_text(json.dumps(model))
    else:
        import skidyn  # a peer that has such a model has the package too

        skidyn.save_model(name.with_suffix(".skops"), model)


@contextlib.contextmanager
def _limit(seconds: float):
    def stop(*_) -> None:
        raise TimeoutError(f"no answer in {seconds:g} s")

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def main() -> None:
    warnings.simplefilter("ignore")
    file, stage, seconds = Path(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    cases = [Path(word) for word in sys.argv[4:]]
    peer = load(file)
    folder = cases[0].parents[1] / "answers" / file.stem
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):
        for case in cases:
            out = folder / f"{case.name}.json"
            said = (
                judge(peer, case, out, seconds) if stage == "errors" else ask(peer, case, seconds)
            )
            out.write_text(json.dumps(said, indent=1))


if __name__ == "__main__":
    main()
