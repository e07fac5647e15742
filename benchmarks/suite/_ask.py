# SPDX-License-Identifier: BSD-3-Clause
"""One peer, many cases: ``python _ask.py PEER.py SECONDS CASE ...``, in the peer's environment."""

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
    """Error on trajectories left out over the base model's, root mean square over joints."""
    said = fitted["predict"](test)
    ratios = [
        np.mean((r.torque - s) ** 2) / np.mean(r.torque**2)
        for r, s in zip(test.joints, said, strict=True)
    ]
    return float(np.sqrt(np.mean(ratios)))


def ask(peer, case: Path, seconds: float) -> dict:
    """The peer's answer to the whole log, and its error on trajectories left out of it.

    A peer that fails or takes more than ``seconds`` of the processor counts as silent, with the
    reason; one that takes more for the error has none.
    """
    whole, train, test = read(case)
    said = {"case": case.name, "verdict": "complete", "effects": []}
    said["version"] = f"{peer.PACKAGE} {version(peer.PACKAGE)}"
    start = time.process_time()
    try:
        with _limit(seconds):
            found = dict(peer.answer(whole, whole.urdf))
        can_predict = found.pop("predict", None) is not None
        said |= found
    except Exception as error:  # a peer's fault must not end the comparison
        can_predict, said["fault"] = False, f"{type(error).__name__}: {error}"
    said["seconds"] = time.process_time() - start
    if can_predict:
        with contextlib.suppress(TimeoutError), _limit(seconds):
            said["error_held_out"] = held_out_error(peer.answer(train, train.urdf), test)
    return said


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
    file, seconds, cases = Path(sys.argv[1]), float(sys.argv[2]), [Path(w) for w in sys.argv[3:]]
    peer = load(file)
    for case in cases:
        with contextlib.redirect_stdout(io.StringIO()):
            said = ask(peer, case, seconds)
        out = case.parents[1] / "answers" / file.stem / f"{case.name}.json"
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(json.dumps(said, indent=1))


if __name__ == "__main__":
    main()
