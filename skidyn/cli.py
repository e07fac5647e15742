# SPDX-License-Identifier: BSD-3-Clause
"""The command line: ``skidyn COMMAND --help`` teaches each command."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from shutil import get_terminal_size
from typing import Any, NoReturn, TextIO, cast

from skidyn._commands import COMMANDS
from skidyn._commands._terminal import FittingStream, TeachingFormatter, fit
from skidyn._exceptions import LogWarning, SkidynError

#: Exit codes: done; the input is at fault; stopped by the user.
DONE, BAD_INPUT, STOPPED = 0, 2, 130

_DESCRIPTION = """\
Robot inverse dynamics: compare a model with measurements, see where it fails, learn what is
missing, add it and watch the error fall.
"""
_EPILOG = """\
A first contact:

  skidyn demo                                             the whole loop on a simulated log
  skidyn check run1.csv --urdf robot.urdf                 is the log good enough?
  skidyn diagnose run*.csv --urdf robot.urdf --out report.json --html report.html
  skidyn add --from report.json --effect dahl --joints 1,4

skidyn COMMAND --help explains each command with examples. --json prints any result for programs.
Exit codes: 0 done, 2 the input is at fault, 130 stopped by Ctrl-C. Files are written whole or not
at all.
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
    parser = make_parser()
    options = parser.parse_args(arguments)
    if not hasattr(options, "run"):
        parser.print_help()
        return BAD_INPUT
    try:
        with warnings.catch_warnings(record=True) as caught, _fitting():
            warnings.simplefilter("always")
            try:
                options.run(options)
            finally:  # what is odd about a log often explains why it was refused
                for text in dict.fromkeys(str(w.message) for w in caught if _is_ours(w)):
                    _complain(f"warning: {text}")
    except BrokenPipeError:  # the reader, such as head, has seen enough
        # what is still buffered must not raise again when Python shuts down
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (SkidynError, OSError, ImportError) as error:
        _complain(f"skidyn {options.command}: {error}")
        return BAD_INPUT
    except KeyboardInterrupt:
        print("stopped; no file was left half written", file=sys.stderr)
        return STOPPED
    return DONE


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints fit the terminal."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        _complain(f"{self.prog}: {message}")
        raise SystemExit(BAD_INPUT)


def make_parser() -> argparse.ArgumentParser:
    """Parser of the command line.

    Returns
    -------
    argparse.ArgumentParser
        One subparser per command.
    """
    from skidyn import __version__

    parser = _Parser(
        prog="skidyn",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=TeachingFormatter,
    )
    parser.add_argument("--version", action="version", version=f"skidyn {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for command in COMMANDS:
        command.add_parser(commands)
    return parser


def _fitting() -> AbstractContextManager[Any]:
    """Print lines that fit where a person looks; the bytes of a pipe or file are left alone."""
    if not sys.stdout.isatty():
        return nullcontext()
    return redirect_stdout(cast(TextIO, FittingStream(sys.stdout)))


def _complain(text: str) -> None:
    if sys.stderr.isatty():
        text = "\n".join(fit(line, get_terminal_size().columns) for line in text.split("\n"))
    print(text, file=sys.stderr)


def _is_ours(caught: warnings.WarningMessage) -> bool:
    return issubclass(caught.category, LogWarning)


if __name__ == "__main__":
    sys.exit(main())
