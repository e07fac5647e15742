# SPDX-License-Identifier: BSD-3-Clause
"""The command line as a person sees it: in a terminal, with Ctrl-C, narrow, and completed."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import shutil
import struct
import subprocess
import sys
import time

import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log

pandas = pytest.importorskip("pandas")
pty = pytest.importorskip("pty", reason="no terminals here")
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")


@pytest.fixture(scope="module")
def short(work, tmp_path_factory):
    """Words that name a short log and its robot."""
    folder = tmp_path_factory.mktemp("terminal")
    log = make_hidden_effect_log(
        load_planar_arm(), "stribeck", joints=[2], n_trajectories=3, duration=5.0
    )
    log.frame.to_csv(folder / "log.csv", index=False)
    return [str(folder / "log.csv"), "--urdf", str(work / "arm.urdf")]


def in_terminal(*words, columns=80, stop_at=None, before="", **environment):
    """Exit code and what a terminal of some width shows; Ctrl-C once it shows ``stop_at``."""
    import fcntl
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    # The terminal tells its size, whatever some runner of tests has set.
    own = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")}
    process = subprocess.Popen(
        [sys.executable, "-c", CONTROLLED.format(before=before), *map(str, words)],
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        env={**own, "TERM": "xterm", **environment},
    )  # fmt: skip
    os.close(theirs)
    shown, deadline = "", time.monotonic() + 120
    while time.monotonic() < deadline:
        if not select.select([ours], [], [], 0.2)[0]:
            continue
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part.decode(errors="replace")
        if stop_at is not None and stop_at in ESCAPE.sub("", shown):
            with contextlib.suppress(OSError):
                os.write(ours, b"\x03")
            stop_at = None
    os.close(ours)
    return process.wait(30), shown.replace("\r\n", "\n")


#: The process takes the terminal, so that Ctrl-C reaches it as from a keyboard.
CONTROLLED = """
import fcntl, signal, sys, termios
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background shell ignores it
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
from skidyn.cli import main
{before}
sys.exit(main(sys.argv[1:]))
"""

#: A search that waits for Ctrl-C, however fast the machine.
ENDLESS_SEARCH = """
import time
from skidyn.diagnosis import _search
_search._Search.pick = lambda *_: time.sleep(3600)
"""


def test_ctrl_c_in_the_search_leaves_no_file_and_no_traceback(short, tmp_path):
    out, page = tmp_path / "report.json", tmp_path / "report.html"

    words = ["diagnose", *short, "--jobs", "2", "--out", out, "--html", page]
    code, shown = in_terminal(*words, stop_at="Round 1", before=ENDLESS_SEARCH)

    assert code == cli.STOPPED
    assert "Traceback" not in shown
    assert ESCAPE.sub("", shown).splitlines()[-1] == "stopped; no file was left incomplete"
    assert shown.rfind("\x1b[?25h") > shown.rfind("\x1b[?25l")  # the cursor is shown again
    assert list(tmp_path.iterdir()) == []


def test_names_in_files_do_not_reach_the_terminal_as_commands(short, tmp_path):
    frame = pandas.read_csv(short[0])
    frame["\x1b]0;title\x07\x1b[2Jvoice\x9b"] = 1.0
    frame.drop(columns="tau1").to_csv(tmp_path / "log.csv", index=False)

    code, shown = in_terminal("compare", tmp_path / "log.csv", *short[1:])

    assert code == cli.BAD_INPUT
    shown = ESCAPE.sub("", shown)  # of the bar
    assert r"\x1b]0;title\x07\x1b[2Jvoice\x9b" in "".join(shown.split("\n    "))
    assert not set("\x1b\x07\x9b") & set(shown)


def test_ctrl_c_ends_the_explorer(short, tmp_path):
    pytest.importorskip("uvicorn", reason="needs skidyn[explore]")

    code, shown = in_terminal(
        "explore", *short, "--no-browser", "--folder", tmp_path, stop_at="open http://127.0.0.1:"
    )

    assert code == cli.STOPPED
    assert "Traceback" not in shown
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_lines_fit_a_narrow_terminal_and_colours_can_be_off(short):
    code, shown = in_terminal("diagnose", *short, columns=60, NO_COLOR="1")

    assert code == cli.DONE
    assert not re.search(r"\x1b\[[0-9;]*(3[0-7]|38|9[0-7])[;m]", shown)
    *_, text = re.split(r"\x1b\[\?25h", shown)  # what follows the last bar
    lines = ESCAPE.sub("", text).split("\n")
    assert max(len(line.rpartition("\r")[2]) for line in lines) <= 60
    assert "Stribeck friction on joint 2" in text


def test_a_program_gets_json_alone_and_nothing_beside(short, capfd):
    assert cli.main(["compare", *short, "--json"]) == cli.DONE

    out, errors = capfd.readouterr()
    assert json.loads(out)["table"]
    assert "\x1b" not in out + errors
    assert all(line.startswith("warning: ") for line in errors.splitlines())


def test_help_keeps_examples_that_can_be_copied(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "60")
    with pytest.raises(SystemExit):
        cli.main(["diagnose", "--help"])

    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 60
    copied = text.replace(" \\\n      ", " ")
    assert "skidyn diagnose run1.csv run2.csv --urdf robot.urdf --out report.json" in copied


BASH = shutil.which("bash")


@pytest.mark.skipif(BASH is None, reason="bash is not installed")
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("skidyn dia", ["diagnose"]),
        ("skidyn diagnose ru", ["run1.csv", "run2.csv"]),
        ("skidyn diagnose run1.csv run2", ["run2.csv"]),
        ("skidyn diagnose run1.csv --urdf a", ["arm.urdf"]),
        ("skidyn add --effect str", ["stribeck", "stribeck_load_friction"]),
        ("skidyn diagnose run1.csv --effects stribeck,dah", ["stribeck,dahl"]),
        ("skidyn export run1.csv --ur", ["--urdf"]),
    ],
)
def test_a_shell_completes(typed, offered, completion, tmp_path):
    for name in ("run1.csv", "run2.csv", "arm.urdf"):
        (tmp_path / name).touch()
    ask = (
        f"source {completion}; COMP_WORDS=({typed}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); "
        '_shtab_skidyn; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(
        [BASH, "--norc", "-c", ask], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert sorted(done.stdout.split()) == offered


@pytest.fixture(scope="module")
def completion(tmp_path_factory):
    """The script for bash."""
    pytest.importorskip("shtab", reason="needs skidyn[shell]")
    path = tmp_path_factory.mktemp("completion") / "skidyn.bash"
    with path.open("w", encoding="utf-8") as file, contextlib.redirect_stdout(file):
        assert cli.main(["completion", "bash"]) == cli.DONE
    return path


def test_zsh_completes_several_files(capsys):
    pytest.importorskip("shtab", reason="needs skidyn[shell]")
    assert cli.main(["completion", "zsh"]) == cli.DONE

    script = capsys.readouterr().out
    assert '"*:recordings, one or more files:_files"' in script
    assert '"(*):' not in script
    assert "diagnose:'identify missing effects'" in script
