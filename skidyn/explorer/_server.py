# SPDX-License-Identifier: BSD-3-Clause
"""The explorer's local page: reachable only from this machine, with a random token."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from skidyn._bundled import bundled
from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional
from skidyn._progress import listening
from skidyn.effects import get_effect
from skidyn.explorer._session import Session
from skidyn.identification import RBDRegressor
from skidyn.measurement import Suspicion
from skidyn.simulation import Controller

#: Files that are saved in the folder chosen at the start.
SAVED = ("model.skops", "explored.py", "report.html")
HOST = "127.0.0.1"
#: Longest request, bytes; those of the page itself have some hundred bytes.
LONGEST_BODY = 2**16
#: Headers of every answer to the page.
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self' 'unsafe-inline'; img-src data:",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


class Explorer:
    """Answer requests of the page one at a time; the report is made in a separate thread.

    Results are saved in the folder; ``checks`` are suspicions about the log, and the other
    arguments are those of ``session.script``.
    """

    def __init__(
        self, session: Session, folder: Path, checks: Sequence[Suspicion] = (), **script: Any
    ) -> None:
        self.session, self.folder, self.script = session, Path(folder), script
        self.checks = [{**check.to_dict(), "benefit": check.benefit} for check in checks]
        self.token = secrets.token_urlsafe(24)
        self._saved: RBDRegressor | None = None
        self._told: dict[str, Any] = {"text": "", "share": None}

    def answer(self, question: str, words: dict[str, Any]) -> dict[str, Any]:
        """Answer a request of the page with its arguments, in JSON types only."""
        known: dict[str, Callable[..., dict[str, Any]]] = {
            "state": self._state,
            "curves": self._curves,
            "ranked": self._ranked,
            "add": self._add,
            "refine": self._refine,
            "undo": self._undo,
            "remove": self._remove,
            "sizes": self._sizes,
            "save": self._save,
            "report": self._report,
            "progress": self._progress,
        }
        if question not in known:
            raise SkidynError(f"unknown request {question!r}")
        return known[question](**words)

    def _state(self) -> dict[str, Any]:
        s = self.session
        units = ["N" if kind == "prismatic" else "N m" for kind in s.robot.joint_types]
        return {
            "joints": list(s.robot.joint_names),
            "units": units,
            "trajectories": s.trajectories,
            "history": s.history,
            "titles": [get_effect(h["added"]).title if h["added"] else "" for h in s.history],
            "refinable": s.refinable,
            "noise": [float(x) for x in s.noise],
            "worst": s.worst,
            "checks": self.checks,
        }

    def _curves(self, joint: int, trajectory: int) -> dict[str, Any]:
        return {
            "torque": self.session.curves(int(joint), int(trajectory)),
            "residual": self.session.residuals(int(joint), int(trajectory)),
        }

    def _ranked(
        self, joint: int, trajectory: int | None = None, time: float | None = None
    ) -> dict[str, Any]:
        span = None
        if trajectory is not None:
            self.session.check_place(int(joint), int(trajectory))
        if time is not None and trajectory is not None:
            span = self.session.stretch(int(joint), int(trajectory), float(time))
        effects = self.session.ranked(int(joint), trajectory, span)
        return {"effects": [asdict(e) for e in effects], "span": span}

    def _add(self, kind: str, joint: int, trajectory: int) -> dict[str, Any]:
        """Add an effect with the shape of the grid, at once; refinement is a later request."""
        self.session.check_place(int(joint), int(trajectory))
        self.session.add(str(kind), int(joint), refined=False)
        return self._changed(joint, trajectory)

    def _refine(self, joint: int, trajectory: int) -> dict[str, Any]:
        self.session.check_place(int(joint), int(trajectory))
        self.session.refine()
        return self._changed(joint, trajectory)

    def _undo(self, joint: int, trajectory: int) -> dict[str, Any]:
        self.session.check_place(int(joint), int(trajectory))
        self.session.undo()
        return self._changed(joint, trajectory)

    def _remove(self, step: int, joint: int, trajectory: int) -> dict[str, Any]:
        self.session.check_place(int(joint), int(trajectory))
        self.session.remove(int(step))
        return self._changed(joint, trajectory)

    def _sizes(self) -> dict[str, Any]:
        return {"sizes": self.session.sizes(), "sure": self.session.sure()}

    def _changed(self, joint: int, trajectory: int) -> dict[str, Any]:
        return {**self._state(), "curves": self._curves(joint, trajectory)}

    def _save(self) -> dict[str, Any]:
        """Model and script, under fixed names in the folder chosen at the start."""
        from skidyn import save_model
        from skidyn._writing import write_text

        self.session.refine()
        self.folder.mkdir(parents=True, exist_ok=True)
        self._saved = self.session.fitted_model()
        files = [
            save_model(self.folder / "model.skops", self._saved),
            write_text(self.folder / "explored.py", self.session.script(**self.script)),
        ]
        return {"saved": [str(file) for file in files]}

    def _report(self) -> dict[str, Any]:
        """Make a report on the model saved last, with the effects that are still missing."""
        from skidyn.diagnosis import diagnose
        from skidyn.report import summarize, write_html

        if self._saved is None:
            raise SkidynError("no model is saved yet")
        with listening(self._hear):
            diagnosis = diagnose(self._saved, *self.session.data, force=True)
        return {"saved": [str(write_html(self.folder / "report.html", summarize(diagnosis)))]}

    def _hear(self, text: str, share: float | None) -> None:
        self._told = {"text": text, "share": share}

    def _progress(self) -> dict[str, Any]:
        """Progress of the report."""
        return self._told


def page() -> str:
    """The page as one HTML file."""
    folder = files("skidyn.explorer").joinpath("static")
    text = folder.joinpath("explorer.html").read_text("utf-8")
    for name in ("uPlot.css", "uPlot.js"):
        text = text.replace(f"/*{name}*/", bundled(name))
    for name in ("explorer.css", "explorer.js"):
        text = text.replace(f"/*{name}*/", folder.joinpath(name).read_text("utf-8"))
    return text


class _Worker:
    """A thread that answers requests one after another, and ends with the process.

    Threads of concurrent.futures delay the end of the process: after Ctrl-C, until a report is
    done.
    """

    def __init__(self, name: str) -> None:
        self._tasks: SimpleQueue[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]] = (
            SimpleQueue()
        )
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Call a function after all earlier ones."""
        future: Future[Any] = Future()
        self._tasks.put((future, function, arguments))
        return future

    def _run(self) -> None:
        while True:
            future, function, arguments = self._tasks.get()
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(function(*arguments))
                except BaseException as error:  # passed on to the caller
                    future.set_exception(error)


def _refuse_constant(name: str) -> float:
    raise SkidynError(f"{name} is not a number in JSON")


async def _body(request: Any) -> bytes | None:
    """Bytes of a request; None as soon as there are too many."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > LONGEST_BODY:
            return None
    return body


def _words(body: bytes) -> dict[str, Any]:
    """Arguments of a request."""
    words = json.loads(body or b"{}", parse_constant=_refuse_constant)
    if not isinstance(words, dict):
        raise SkidynError("an object is expected")
    return words


def make_app(explorer: Explorer, port: int) -> Any:
    """The web application; requests for a host other than this machine at this port are refused."""
    import_optional("starlette", extra="explore")
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response
    from starlette.routing import Route

    # one thread: one answer at a time, and the rigid body's buffers, kept per thread, are reused
    worker = _Worker("skidyn-explore")
    # the report takes long, and the page can be used meanwhile
    beside = {"report": _Worker("skidyn-report"), "progress": _Worker("skidyn-progress")}
    hosts = {f"{HOST}:{port}", f"localhost:{port}"}

    def refused(request: Request, token: str | None) -> bool:
        right = secrets.compare_digest((token or "").encode(), explorer.token.encode())
        return not right or request.headers.get("host") not in hosts

    async def start(request: Request) -> Response:
        if refused(request, request.query_params.get("token")):
            return HTMLResponse("Open the address that skidyn explore printed.", 403)
        return HTMLResponse(page(), headers=HEADERS)

    async def api(request: Request) -> Response:
        if refused(request, request.headers.get("x-token")):
            return JSONResponse({"error": "wrong token"}, 403)
        try:
            body = await _body(request)
            if body is None:
                told = f"a request has at most {LONGEST_BODY} bytes"
                return JSONResponse({"error": told}, 413, headers=HEADERS)
            words = _words(body)
            question = request.path_params["question"]
            thread = beside.get(question, worker)
            content = await asyncio.wrap_future(thread.submit(explorer.answer, question, words))
            return JSONResponse(content, headers=HEADERS)
        except (LookupError, OSError, TypeError, ValueError, OverflowError) as error:
            told = str(error).encode("utf-8", "backslashreplace").decode()  # lone surrogates
            return JSONResponse({"error": told}, 400, headers=HEADERS)
        except RecursionError:
            return JSONResponse({"error": "the request is nested too deeply"}, 400, headers=HEADERS)

    async def saved(request: Request) -> Response:
        """A saved file, by one of the fixed names."""
        name = request.path_params["name"]
        if refused(request, request.query_params.get("token")):
            return HTMLResponse("Open the address that skidyn explore printed.", 403)
        if name not in SAVED or not (explorer.folder / name).is_file():
            return HTMLResponse("There is no such file.", 404)
        # a report loads nothing from elsewhere and contains its own policy
        return FileResponse(explorer.folder / name, headers={"Cache-Control": "no-store"})

    routes = [
        Route("/", start),
        Route("/saved/{name}", saved),
        Route("/api/{question}", api, methods=["POST"]),
    ]
    return Starlette(routes=routes)


def serve(
    session: Session,
    folder: str | Path = ".",
    *,
    logs: Sequence[str] = (),
    urdf: str = "robot.urdf",
    joints: Sequence[str] | None = None,
    reading: Mapping[str, Any] | None = None,
    controller: Controller | None = None,
    checks: Sequence[Suspicion] = (),
    port: int = 0,
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the page on this machine until it is stopped by Ctrl-C.

    Parameters
    ----------
    session : Session
        Model and log.
    folder : path, default="."
        Where model, report and script are saved.
    logs : sequence of str, default=()
        Files of the log, for the script.
    urdf : str, default="robot.urdf"
        Description of the robot, for the script.
    joints : sequence of str, optional
        Joints the log covers, for the script.
    reading : mapping, optional
        Further arguments with which :func:`skidyn.logs.read_log` read the log, for the script.
    controller : Controller, optional
        Position servos whose torque was computed from their commands, for the script.
    checks : sequence of Suspicion, default=()
        Suspicions about the log, which head the page.
    port : int, default=0
        Port; a free one if 0.
    ready : callable, default=print
        Called with the address, which holds the token.

    Raises
    ------
    ImportError
        starlette or uvicorn is not installed (``pip install skidyn[explore]``).

    Examples
    --------
    >>> serve(session, "results")  # doctest: +SKIP
    http://127.0.0.1:54321/?token=...
    """
    uvicorn = import_optional("uvicorn", extra="explore")
    told = {"joints": joints, "reading": reading, "controller": controller}
    explorer = Explorer(session, Path(folder), checks, logs=logs or ("log.csv",), urdf=urdf, **told)
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind((HOST, port))
    listener.listen()  # a page that is opened at once waits instead of being refused
    port = listener.getsockname()[1]
    app = make_app(explorer, port)
    # a report that is being made is abandoned: files are written completely or not at all
    config = uvicorn.Config(
        app, log_level="critical", access_log=False, timeout_graceful_shutdown=1
    )
    ready(f"http://{HOST}:{port}/?token={explorer.token}")
    uvicorn.Server(config).run(sockets=[listener])
