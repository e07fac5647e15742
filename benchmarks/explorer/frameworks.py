# SPDX-License-Identifier: BSD-3-Clause
"""Frameworks for the explorer's page: their size and the time to the first plot.

Each gets a fresh virtual environment and the same task: a page with one plot of 1500 points and a
button. The script measures packages and megabytes in addition to an empty environment, seconds from
the start of Python to the first response and to the plot in Chromium, and the data loaded by the
browser.

    python benchmarks/explorer/frameworks.py --folder /somewhere/with/space
"""

from __future__ import annotations

import argparse
import json
import shutil
import socket
import statistics
import subprocess
import sys
import time
import urllib.error
import urllib.request
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

CURVE = "import math\nx = [i / 100 for i in range(1500)]\ny = [math.sin(t) for t in x]\n"
UPLOT = """
page = f'''<!doctype html><div id=plot></div><button>add</button><script>{script}</script>
<script>new uPlot({{width: 600, height: 300, series: [{{}}, {{stroke: "blue"}}]}}, {[x, y]},
document.getElementById("plot"))</script>'''
"""


@dataclass(frozen=True)
class Framework:
    """What to install, the page written with it, how to start it and what shows the plot."""

    packages: tuple[str, ...]
    source: str
    start: tuple[str, ...]
    shown: str
    path: str = "/"


FRAMEWORKS = {
    "Starlette + uPlot": Framework(
        ("starlette", "uvicorn"),
        "import sys\nfrom pathlib import Path\n"
        + CURVE
        + "script = Path('uPlot.js').read_text()\n"
        + UPLOT
        + """
import uvicorn
from starlette.applications import Starlette
from starlette.responses import HTMLResponse
from starlette.routing import Route
app = Starlette(routes=[Route("/", lambda request: HTMLResponse(page))])
uvicorn.run(app, port=int(sys.argv[1]), log_level="error")
""",
        ("python", "app.py", "{port}"),
        "canvas",
    ),
    "FastAPI + uPlot": Framework(
        ("fastapi", "uvicorn"),
        "import sys\nfrom pathlib import Path\n"
        + CURVE
        + "script = Path('uPlot.js').read_text()\n"
        + UPLOT
        + """
import uvicorn
from fastapi import FastAPI
from fastapi.responses import HTMLResponse
app = FastAPI()
@app.get("/", response_class=HTMLResponse)
def start():
    return page
uvicorn.run(app, port=int(sys.argv[1]), log_level="error")
""",
        ("python", "app.py", "{port}"),
        "canvas",
    ),
    "Dash": Framework(
        ("dash",),
        "import sys\n"
        + CURVE
        + """
from dash import Dash, dcc, html
app = Dash()
figure = {"data": [{"x": x, "y": y, "type": "scatter"}]}
app.layout = html.Div([dcc.Graph(figure=figure), html.Button("add")])
app.run(port=int(sys.argv[1]))
""",
        ("python", "app.py", "{port}"),
        ".js-plotly-plot .scatterlayer",
    ),
    "Panel": Framework(
        ("panel",),
        CURVE
        + """
import panel as pn
from bokeh.plotting import figure
pn.extension()
plot = figure(width=600, height=300)
plot.line(x, y)
pn.Column(pn.pane.Bokeh(plot), pn.widgets.Button(name="add")).servable()
""",
        ("panel", "serve", "app.py", "--port", "{port}"),
        "canvas",
        "/app",
    ),
    "NiceGUI": Framework(
        ("nicegui", "plotly"),
        "import sys\n"
        + CURVE
        + """
from nicegui import ui
@ui.page("/")
def start():
    ui.plotly({"data": [{"x": x, "y": y, "type": "scatter"}]})
    ui.button("add")
ui.run(port=int(sys.argv[1]), show=False, reload=False)
""",
        ("python", "app.py", "{port}"),
        ".js-plotly-plot .scatterlayer",
    ),
    "marimo": Framework(
        ("marimo", "plotly"),
        """
import marimo
app = marimo.App()
@app.cell
def _():
    import math
    import marimo as mo
    import plotly.graph_objects as go
    x = [i / 100 for i in range(1500)]
    figure = go.Figure(go.Scatter(x=x, y=[math.sin(t) for t in x]))
    mo.vstack([mo.ui.plotly(figure), mo.ui.button(label="add")])
    return
""",
        ("marimo", "run", "app.py", "--headless", "--no-token", "--port", "{port}"),
        ".js-plotly-plot .scatterlayer",
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, required=True, help="for the environments")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--chromium", default=shutil.which("chromium"))
    options = parser.parse_args()
    bare = weigh(environment(options.folder / "bare", ()))
    print(
        f"{'':18s}{'packages':>9s}{'MB':>8s}{'answer s':>10s}{'plot s':>8s}{'loaded MB':>11s}",
        flush=True,
    )
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=options.chromium, args=["--no-sandbox", "--disable-gpu"]
        )
        for name, framework in FRAMEWORKS.items():
            folder = options.folder / "".join(filter(str.isalnum, name)).lower()
            python = environment(folder, framework.packages)
            packages, size = (a - b for a, b in zip(weigh(python), bare, strict=True))
            (folder / "app.py").write_text(framework.source, encoding="utf-8")
            uplot = files("skidyn").joinpath("static", "uPlot.js").read_text("utf-8")
            (folder / "uPlot.js").write_text(uplot, encoding="utf-8")
            start(folder, framework, browser)  # compiles, and fills the disk's cache
            runs = [start(folder, framework, browser) for _ in range(options.runs)]
            answer, plot, loaded = (statistics.median(column) for column in zip(*runs, strict=True))
            print(
                f"{name:18s}{packages:9.0f}{size / 1e6:8.1f}{answer:10.2f}{plot:8.2f}"
                f"{loaded / 1e6:11.2f}",
                flush=True,
            )
        browser.close()


def environment(folder: Path, packages: tuple[str, ...]) -> Path:
    """Python of a fresh environment with some packages."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        if packages:
            subprocess.run([python, "-m", "pip", "install", "-q", *packages], check=True)
    return python


def weigh(python: Path) -> tuple[int, int]:
    """Number of packages and bytes of an environment."""
    listed = subprocess.run(
        [python, "-m", "pip", "list", "--format", "json"], capture_output=True, check=True
    )
    (library,) = (python.parents[1] / "lib").glob("python*")
    size = sum(
        f.stat().st_size for f in library.rglob("*") if f.is_file() and "__pycache__" not in f.parts
    )
    return len(json.loads(listed.stdout)), size


def start(folder: Path, framework: Framework, browser: Any) -> tuple[float, float, float]:
    """Seconds to the first answer, seconds to the plot, and bytes the browser loads."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    program, *words = (word.format(port=port) for word in framework.start)
    address = f"http://127.0.0.1:{port}{framework.path}"
    began = time.perf_counter()
    process = subprocess.Popen(
        [folder / "bin" / program, *words],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        while not answers(address):
            if process.poll() is not None or time.perf_counter() - began > 60:
                raise SystemExit(f"{folder.name} does not start")
            time.sleep(0.01)
        answer = time.perf_counter() - began
        context = browser.new_context()
        tab = context.new_page()
        devtools = context.new_cdp_session(tab)
        devtools.send("Network.enable")
        loaded: list[float] = []
        devtools.on("Network.loadingFinished", lambda e: loaded.append(e["encodedDataLength"]))
        tab.goto(address)
        tab.wait_for_selector(framework.shown, state="attached", timeout=60_000)
        plot = time.perf_counter() - began
        context.close()
        return answer, plot, sum(loaded)
    finally:
        process.terminate()
        process.wait(20)


def answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(address, timeout=10) as page:
            return bool(page.status == 200)
    except (urllib.error.URLError, ConnectionError, TimeoutError):
        return False


if __name__ == "__main__":
    main()
