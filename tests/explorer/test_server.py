# SPDX-License-Identifier: BSD-3-Clause
"""The explorer's page: who may use it, and the loop click by click in a real browser."""

from __future__ import annotations

import http.client
import json
import shutil
import socket
import threading
import time
import warnings
from contextlib import contextmanager

import pytest

from skidyn import load_model
from skidyn.datasets import load_recording
from skidyn.explorer import Session
from skidyn.explorer._server import Explorer, make_app, page
from skidyn.rigid_body import RBDRegressor
from skidyn.robots import Robot

pytest.importorskip("starlette", reason="needs skidyn[explore]")
uvicorn = pytest.importorskip("uvicorn", reason="needs skidyn[explore]")
CHROMIUM = shutil.which("chromium")
ARGUMENTS = (
    *("--no-sandbox", "--disable-gpu", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)


@pytest.fixture
def explorer(session, tmp_path):
    return Explorer(session, tmp_path)


@pytest.fixture
def ur10e(data_dir, tmp_path):
    """Three recordings of a real UR10e."""
    folder = data_dir / "ur10e"
    runs = ["ur-20_02_10-30sec_12harm", "ur-20_02_12-40sec_12harm", "ur-20_02_05-20sec_12harm"]
    gains = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the recordings' own faults are listed elsewhere
        log = load_recording(folder / "ur10e_excitation.npz", run=runs, drive_gains=gains).frame
    columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in range(1, 7))]
    robot = Robot.from_urdf(folder / "ur10e_min.urdf")
    model = RBDRegressor(robot, ("viscous", "coulomb", "offset", "rotor_inertia"))
    tau = log[[f"tau{j}" for j in range(1, 7)]].to_numpy()
    return Explorer(Session(model, log[columns], tau), tmp_path)


@pytest.fixture
def port(explorer):
    """The page served on this machine."""
    with served(explorer) as port:
        yield port


@contextmanager
def served(explorer):
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    server = uvicorn.Server(uvicorn.Config(make_app(explorer, port), log_level="error"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield port
    server.should_exit = True
    thread.join(10)


def ask(port, path, body=None, token="", host=None):
    """Status and content of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    headers = {"X-Token": token} | ({"Host": host} if host else {})
    method = "GET" if body is None else "POST"
    connection.request(
        method, path, body=body if body is None else json.dumps(body), headers=headers
    )
    answer = connection.getresponse()
    content = answer.read().decode()
    connection.close()
    kind = answer.headers.get_content_type()
    return answer.status, json.loads(content) if kind == "application/json" else content


def test_only_who_has_the_token_gets_an_answer(port, explorer):
    token = explorer.token

    assert ask(port, "/")[0] == 403
    assert ask(port, f"/?token={token}")[0] == 200
    assert ask(port, "/api/state", {})[0] == 403
    assert ask(port, "/api/state", {}, token)[1]["joints"] == ["joint1", "joint2"]
    # a page of another site whose name leads to this machine sends its own host
    assert ask(port, "/api/state", {}, token, host="evil.example")[0] == 403


def test_bad_questions_get_an_error_and_change_nothing(port, explorer):
    for question, words in (
        ("unknown", {}),
        ("add", {"kind": "<script>", "joint": 1}),
        ("add", {"kind": "spring", "joint": 77}),
        ("save", {"folder": "/elsewhere"}),
        ("curves", {}),
        ("state", [1]),
    ):
        status, content = ask(port, f"/api/{question}", words, explorer.token)
        assert status == 400, question
        assert "<script>" not in content["error"]
    assert len(explorer.session.history) == 1


def test_the_page_holds_all_it_needs():
    text = page()

    assert "uPlot" in text
    assert 'src="' not in text
    assert "<link" not in text


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_the_loop_click_by_click(port, explorer, tmp_path):
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    complaints: list[str] = []
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        tab = browser.new_page(viewport={"width": 1280, "height": 860})
        tab.set_default_timeout(15_000)
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.goto(f"http://127.0.0.1:{port}/?token={explorer.token}")
        tab.wait_for_selector("body[data-ranked='1 all 1']")
        tab.reload()  # the address holds all that the page needs
        tab.wait_for_selector("body[data-ranked='1 all 1']")
        # choose the joint, look at another trajectory
        tab.select_option("#joint", "2")
        tab.wait_for_selector("body[data-ranked='2 all 1']")
        tab.select_option("#trajectory", "1")
        tab.wait_for_selector("body[data-drawn='2 1 1']")
        # click where it fails
        tab.click("#residual .u-over", position={"x": 200, "y": 60})
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        assert " s" in tab.text_content("#where")
        # tick the spring: the error falls
        tab.click("#effects button[data-kind=spring]")
        tab.wait_for_selector("body[data-ranked='2 span 2']")
        given, now = (
            float(tab.text_content(f"#errors tbody tr:nth-child(2) td:nth-child({k})"))
            for k in (2, 3)
        )
        assert now < 0.2 * given
        assert tab.text_content("#added li") == "spring on joint 2"
        assert now == pytest.approx(explorer.session.history[-1]["rmse"][1], rel=0.01)
        # undo, and again
        tab.click("#undo")
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        assert tab.is_disabled("#undo")
        tab.click("#effects button[data-kind=spring]")
        tab.wait_for_selector("body[data-ranked='2 span 2']")
        tab.click("#save")
        tab.wait_for_selector("#status:has-text('saved: ')")
        browser.close()
    assert complaints == []
    model = load_model(tmp_path / "model.skops")
    assert any(t.kind == "spring" for t in model.effect_terms_)
    assert "Term('spring', (1,)" in (tmp_path / "explored.py").read_text()
    assert "</html>" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_load_dependent_friction_of_a_real_robot_is_ticked_and_the_error_falls(ur10e):
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    complaints: list[str] = []
    with served(ur10e) as port, sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        tab = browser.new_page(viewport={"width": 1280, "height": 860})
        tab.set_default_timeout(20_000)
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.goto(f"http://127.0.0.1:{port}/?token={ur10e.token}")
        tab.wait_for_selector("body[data-ranked='1 all 1']")
        tab.select_option("#joint", "2")
        tab.wait_for_selector("body[data-ranked='2 all 1']")
        first = tab.get_attribute("#effects li:first-child button", "data-kind")
        tab.click("#residual .u-over", position={"x": 300, "y": 60})
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        tab.click("#effects button[data-kind=load_dependent_friction]")
        tab.wait_for_selector("body[data-ranked='2 span 2']")
        given, now = (
            float(tab.text_content(f"#errors tbody tr:nth-child(2) td:nth-child({k})"))
            for k in (2, 3)
        )
        browser.close()
    assert complaints == []
    assert first == "load_dependent_friction"
    assert now < 0.7 * given
