# SPDX-License-Identifier: BSD-3-Clause
"""The explorer's page: who may use it, and the loop click by click in a real browser."""

from __future__ import annotations

import http.client
import json
import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings
from contextlib import contextmanager
from queue import SimpleQueue
from types import SimpleNamespace
from urllib.parse import parse_qs, urlsplit

import pytest

from skidyn import load_model
from skidyn.explorer import Session, serve
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.measurement import Remedy, Suspicion
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
    return SimpleNamespace(session=session, folder=tmp_path)


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
    return SimpleNamespace(session=Session(model, log[columns], tau), folder=tmp_path)


@pytest.fixture
def port(explorer):
    """The page served on this machine."""
    with served(explorer) as port:
        yield port


@contextmanager
def served(explorer):
    """The port on which a session is served; its token is then known."""
    servers, addresses = [], SimpleQueue()

    class Stoppable(uvicorn.Server):
        def run(self, *arguments, **options):
            servers.append(self)
            super().run(*arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uvicorn, "Server", Stoppable)
        options = {"ready": addresses.put, "checks": getattr(explorer, "checks", ())}
        words = {"args": (explorer.session, explorer.folder), "kwargs": options}
        thread = threading.Thread(target=serve, daemon=True, **words)
        thread.start()
        address = urlsplit(addresses.get(timeout=60))
        explorer.token = parse_qs(address.query)["token"][0]
        try:
            yield address.port
        finally:
            while not servers:
                time.sleep(0.01)
            servers[0].should_exit = True
            thread.join(10)


def ask(port, path, body=None, token="", host=None):
    """Status and content of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
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


def test_suspicions_about_the_log_are_told_with_the_state(explorer):
    remedy = Remedy("--flip elbow", "flip=['elbow']")
    explorer.checks = (Suspicion("reading", "a sign", "seen", "certain", (2,), remedy),)
    with served(explorer) as port:
        status, state = ask(port, "/api/state", {}, explorer.token)
    assert status == 200 and state["checks"][0]["remedy"]["option"] == "--flip elbow"


def test_bad_questions_get_an_error_and_change_nothing(port, explorer):
    ask(port, "/api/add", {"kind": "spring", "joint": 2, "trajectory": 1}, explorer.token)
    before = explorer.session.history
    for question, words in (
        ("unknown", {}),
        ("add", {"kind": "<script>", "joint": 1}),
        ("add", {"kind": "spring", "joint": 77}),
        ("save", {"folder": "/elsewhere"}),
        ("curves", {}),
        ("ranked", {"joint": 1, "trajectory": 99, "time": 1.0}),
        ("state", [1]),
        ("add", {"kind": "spring", "joint": 2, "trajectory": 99}),
        ("remove", {"step": 1, "joint": 2, "trajectory": 99}),
        ("remove", {"step": 1, "joint": 77, "trajectory": 1}),
        ("ranked", {"joint": 1, "trajectory": [], "time": 1.0}),
        ("ranked", {"joint": 1, "trajectory": {"a": 1}, "time": 1.0}),
        ("ranked", {"joint": 1, "trajectory": 1, "time": float("inf")}),
        ("ranked", {"joint": 1, "trajectory": 1, "time": float("nan")}),
    ):
        status, content = ask(port, f"/api/{question}", words, explorer.token)
        assert status == 400, question
        assert content["error"]
    assert explorer.session.history == before and len(before) == 2


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (b"[" * 50_000, 400),
        (b'{"joint": 1e999, "trajectory": 1}', 400),
        (b'{"joint": 1, "trajectory": 1, "time": 1e308}', 400),
        (b'{"joint": "\xff"}', 400),
        (b'{"\\ud800": 1}', 400),
        (b'{"joint": "\\ud800", "trajectory": 1}', 400),
        (b'{"joint": 1, "trajectory": 1e400}', 400),
        (b" " * 300_000, 413),
    ],
)
def test_bodies_that_break_parsers_are_refused(port, explorer, body, expected):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("POST", "/api/ranked", body=body, headers={"X-Token": explorer.token})
    answer = connection.getresponse()
    assert answer.status == expected
    assert json.loads(answer.read())["error"]
    connection.close()


def test_a_token_of_other_letters_is_wrong_and_no_crash(port):
    assert ask(port, "/?token=%C3%A9%E2%82%AC")[0] == 403


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is another thing there")
def test_ctrl_c_does_not_wait_for_a_report(tmp_path):
    code = (
        "import json, signal, sys, threading, time, urllib.request\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import skidyn\n"
        "from skidyn import diagnosis, explorer\n"
        "def diagnose(*words, **options):\n"
        "    print('working', flush=True)\n"
        "    time.sleep(60)\n"
        "diagnosis.diagnose = diagnose\n"
        "skidyn.save_model = lambda path, model: path\n"
        "class Explored:\n"
        "    data = ()\n"
        "    def refine(self): ...\n"
        "    def fitted_model(self): return 'a model'\n"
        "    def script(self, **words): return ''\n"
        "def ready(address):\n"
        "    token, base = address.partition('=')[2], address.partition('?')[0]\n"
        "    def call():\n"
        "        for question in ('save', 'report'):\n"
        "            where = base + 'api/' + question\n"
        "            urllib.request.urlopen(\n"
        "                urllib.request.Request(where, b'{}', {'X-Token': token})\n"
        "            )\n"
        "    threading.Thread(target=call, daemon=True).start()\n"
        "explorer.serve(Explored(), sys.argv[1], ready=ready)\n"
    )
    words = [sys.executable, "-c", code, str(tmp_path)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdout.readline() == b"working\n"
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)  # half of what the answer takes


def test_the_page_holds_all_it_needs(port, explorer):
    status, text = ask(port, f"/?token={explorer.token}")

    assert status == 200
    assert "uPlot" in text
    assert 'src="' not in text
    assert 'rel="stylesheet"' not in text


def test_an_error_is_told_as_it_is(port, explorer):
    """The page shows it as text, so nothing is escaped on the way."""
    _, content = ask(port, "/api/add", {"kind": "<b> & 'c'", "joint": 1, "trajectory": 1},
                     explorer.token)  # fmt: skip

    assert "<b> & 'c' cannot be added to joint 1" in content["error"]


@contextmanager
def opened(explorer, **look):
    """A tab of a real browser that shows the page; it must not complain on its console."""
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    complaints: list[str] = []
    with served(explorer) as port, sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        tab = browser.new_page(**{"viewport": {"width": 1280, "height": 860}, **look})
        tab.set_default_timeout(60_000)
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.goto(f"http://127.0.0.1:{port}/?token={explorer.token}")
        tab.wait_for_selector("body[data-ranked$='all 1']")
        yield tab
        browser.close()
    assert complaints == []


def errors_shown(tab, joint):
    """Held-out error of a joint as given and now, as the table tells."""
    cell = "#errors tbody tr:nth-child({}) td:nth-child({})"
    return [float(tab.text_content(cell.format(joint, k))) for k in (2, 3)]


def test_the_loop_click_by_click(explorer, tmp_path):
    with opened(explorer) as tab:
        tab.reload()  # the address holds all that the page needs
        # it opens on the joint whose error is largest over its noise; look at another trajectory
        tab.wait_for_selector("body[data-ranked='2 all 1']")
        tab.select_option("#trajectory", "2")
        tab.wait_for_selector("body[data-drawn='2 2 1']")
        # click where it fails, and elsewhere: the second click is what counts
        for x in (200, 400):
            tab.click("#residual .u-over", position={"x": x, "y": 60})
            tab.wait_for_selector("body[data-ranked='2 span 1']")
        assert "trajectory 2" in tab.text_content("#where")
        # tick the spring: the error falls
        tab.click("#effects button[data-kind=spring]")
        tab.wait_for_selector("body[data-ranked='2 span 2']")
        given, now = errors_shown(tab, 2)
        assert now < 0.2 * given
        assert tab.text_content("#added li span") == "Spring on joint 2"
        tab.wait_for_selector("#added small:not(:empty)")
        assert "±" in tab.text_content("#added small.size")
        assert "confidence" in tab.text_content("#added small.sure")
        assert now == pytest.approx(explorer.session.history[-1]["rmse"][1], rel=0.05)
        # undo, and again
        tab.click("#undo")
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        assert tab.is_disabled("#undo")
        tab.click("#effects button[data-kind=spring]")
        tab.wait_for_selector("body[data-ranked='2 span 2']")
        tab.click("#whole")
        tab.wait_for_selector("body[data-ranked='2 all 2']")
        tab.click("#save")
        # the report is diagnosed in full, and the loop goes on meanwhile
        tab.select_option("#joint", "1")
        tab.wait_for_selector("body[data-ranked='1 all 2']")
        tab.wait_for_selector("#save:enabled", timeout=240_000)
        assert tab.text_content("#saved").startswith("saved: ")
        for link in tab.locator("#saved a").all():
            assert tab.request.get(tab.evaluate("(a) => a.href", link.element_handle())).ok
        forbidden = tab.evaluate("location.origin") + "/saved/..%2Fsecret?token=" + explorer.token
        assert tab.request.get(forbidden).status == 404
    model = load_model(tmp_path / "model.skops")
    assert any(t.kind == "spring" for t in model.effect_terms_)
    assert "session.add('spring', joint=2)" in (tmp_path / "explored.py").read_text("utf-8")
    assert "</html>" in (tmp_path / "report.html").read_text("utf-8")


def test_the_loop_by_keyboard_alone(explorer):
    with opened(explorer) as tab:
        tab.focus("#joint")
        tab.keyboard.press("ArrowUp")
        tab.wait_for_selector("body[data-ranked='1 all 1']")
        tab.keyboard.press("ArrowDown")
        tab.wait_for_selector("body[data-ranked='2 all 1']")
        tab.keyboard.press("Tab")  # trajectory
        tab.keyboard.press("Tab")  # save, as there is nothing to undo
        tab.keyboard.press("Tab")  # the residual
        assert tab.evaluate("document.activeElement.id") == "residual"
        for _ in range(3):
            tab.keyboard.press("Shift+ArrowRight")
        told = tab.get_attribute("#residual", "aria-valuetext")
        assert " s: measured " in told and tab.text_content("#readout") == told
        tab.keyboard.press("+")
        tab.keyboard.press("Enter")
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        tab.keyboard.press("Escape")
        tab.wait_for_selector("body[data-ranked='2 all 1']")
        tab.focus("#effects button[data-kind=spring]")
        tab.keyboard.press("Enter")
        tab.wait_for_selector("body[data-ranked='2 all 2']")
        given, now = errors_shown(tab, 2)
    assert now < 0.2 * given


@pytest.mark.parametrize(
    ("scheme", "width"), [pytest.param("light", 1280, marks=pytest.mark.slow), ("dark", 800)]
)
def test_the_clicked_time_is_marked_and_nothing_overflows(explorer, scheme, width):
    look = {"color_scheme": scheme, "viewport": {"width": width, "height": 860}}
    with opened(explorer, **look) as tab:
        tab.click("#residual .u-over", position={"x": 100, "y": 60})
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        marked = [tab.evaluate(GREEN, plot) for plot in ("torque", "residual")]
        overflow = tab.evaluate("document.documentElement.scrollWidth - innerWidth")
    # a band with a line of stronger colour in it, where it was clicked
    for start, end in marked:
        assert start <= 100 <= end and end - start < 80
    assert overflow <= 0


#: First and last pixel, from the left of a plot, that is greener than anything but the mark.
GREEN = """(which) => {
  const plot = document.querySelector(`#${which} canvas`), over = plot.parentNode.querySelector(".u-over");
  const box = over.getBoundingClientRect(), all = plot.getBoundingClientRect(), scale = plot.width / all.width;
  const left = Math.round((box.left - all.left) * scale), top = Math.round((box.top - all.top + 3) * scale);
  const row = plot.getContext("2d").getImageData(left, top, Math.round(box.width * scale), 1).data;
  const green = [...Array(row.length / 4).keys()].filter((i) => row[4 * i + 1] > row[4 * i] + 12 && row[4 * i + 1] > row[4 * i + 2]);
  return [green[0] / scale, green.at(-1) / scale];
}"""  # noqa: E501


@pytest.mark.slow
def test_load_dependent_friction_of_a_real_robot_is_ticked_and_the_error_falls(ur10e, tmp_path):
    with opened(ur10e) as tab:
        tab.select_option("#joint", "2")
        tab.wait_for_selector("body[data-ranked='2 all 1']")
        first = tab.get_attribute("#effects li:first-child button", "data-kind")
        tab.click("#residual .u-over", position={"x": 300, "y": 60})
        tab.wait_for_selector("body[data-ranked='2 span 1']")
        tab.click("#effects button[data-kind=load_dependent_friction]")
        tab.wait_for_selector("body[data-ranked='2 span 2']")
        first_step = errors_shown(tab, 2)
        # an effect with a shape: the first answer at once, the refined one after it
        tab.select_option("#joint", "5")
        tab.wait_for_selector("body[data-ranked='5 all 2']")
        tab.click("#effects button[data-kind=maxwell_slip]")
        tab.wait_for_selector("body[data-refined='3']")
        second_step = errors_shown(tab, 5)
        for left in (2, 1):
            tab.click("#undo")
            tab.wait_for_selector(f"body[data-ranked='5 all {left}']")
        undone = errors_shown(tab, 2)
        tab.click("#effects button[data-kind=maxwell_slip]")
        tab.wait_for_selector("body[data-refined='2']")
        tab.click("#save")
        tab.wait_for_selector("#save:enabled", timeout=240_000)
        assert tab.text_content("#saved").startswith("saved: ")
    assert any(t.kind == "maxwell_slip" for t in load_model(tmp_path / "model.skops").effect_terms_)
    assert "session.add('maxwell_slip', joint=5)" in (tmp_path / "explored.py").read_text("utf-8")
    assert "</html>" in (tmp_path / "report.html").read_text("utf-8")
    assert first == "load_dependent_friction"
    assert first_step[1] < 0.9 * first_step[0]
    assert second_step[1] < second_step[0]  # the table shows two digits
    assert undone[0] == undone[1]
