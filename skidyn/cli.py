# SPDX-License-Identifier: BSD-3-Clause
"""The command line: ``skidyn COMMAND --help`` explains each command with examples."""

from __future__ import annotations

import argparse
import codecs
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from shutil import get_terminal_size
from typing import Any, NoReturn, TextIO, cast

from skidyn._exceptions import LogWarning, SkidynError

#: Exit codes: success; failed gate; error in the input; stopped by the user.
DONE, FAILED, BAD_INPUT, STOPPED = 0, 1, 2, 130

_DESCRIPTION = """\
Robot inverse dynamics: compare a model with measurements, see where it fails, identify missing
effects, add them and see the error decrease.
"""
_EPILOG = """\
First steps:

  skidyn demo                                             the whole loop on a simulated log
  skidyn check run1.csv --urdf robot.urdf                 is the log good enough?
  skidyn diagnose run*.csv --urdf robot.urdf --out report.json --html report.html
  skidyn add --from report.json --effect dahl --joints 1,4

skidyn COMMAND --help explains each command with examples. --json prints results as JSON. Exit
codes: 0 done, 1 failed --fail-above, 2 invalid input, 130 stopped by Ctrl-C. Files are written
completely or not at all.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments after ``skidyn``; those of the process by default.

    Returns
    -------
    int
        Exit code: 0 success, 1 failed ``compare --fail-above``, 2 error in the input, 130 stopped
        by Ctrl-C.

    Examples
    --------
    >>> main(["effects", "--json"])  # doctest: +ELLIPSIS
    {...
    0
    """
    command = "skidyn"
    try:  # imports too: they take a second, in which the user may press Ctrl-C
        from skidyn._commands._arguments import check_files
        from skidyn._writing import keeping_inputs

        _open_closed_streams()
        _keep_freed_memory()
        parser = make_parser()
        options = parser.parse_args(arguments)
        options.words = list(sys.argv[1:] if arguments is None else arguments)
        if not hasattr(options, "run"):
            parser.print_help()
            return BAD_INPUT
        command = f"skidyn {options.command}"
        with warnings.catch_warnings(record=True) as caught, _fitting(), keeping_inputs():
            warnings.simplefilter("always")
            try:
                check_files(options)
                passed = options.run(options) is not False
                sys.stdout.flush()  # here, where a full disk is still reported
            finally:  # warnings often explain why a log was refused
                told = getattr(options, "told", ())  # reported by the command itself
                ours = (w for w in caught if issubclass(w.category, LogWarning))
                for text in dict.fromkeys(str(w.message) for w in ours):
                    if text not in told:
                        _complain(f"warning: {text}")
    except BrokenPipeError:  # the reader, such as head, has closed the pipe
        _give_up_output()
    except (SkidynError, OSError, ImportError) as error:
        _complain(f"{command}: {error}")
        try:
            sys.stdout.flush()
        except OSError:
            _give_up_output()
        return BAD_INPUT
    except KeyboardInterrupt:
        print("stopped; no file was left incomplete", file=sys.stderr)
        return STOPPED
    else:
        return DONE if passed else FAILED
    return DONE


def _keep_freed_memory() -> None:
    """Let glibc reuse the memory of freed arrays, which saves a tenth of the time."""
    if not sys.platform.startswith("linux"):
        return
    import ctypes

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # other C libraries have none
    if mallopt is not None:
        trim_threshold, mmap_threshold = -1, -3
        mallopt(trim_threshold, 2**30)
        mallopt(mmap_threshold, 2**25)


class _Parser(argparse.ArgumentParser):
    """A parser whose error messages fit the terminal."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        _complain(f"{self.prog}: {message}")
        raise SystemExit(BAD_INPUT)


class _Version(argparse.Action):
    """As the action ``version``, but the version is read from the metadata only if requested."""

    def __init__(self, option_strings: Sequence[str], dest: str, **_: Any) -> None:
        text = "show program's version number and exit"
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, help=text)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any, **__: Any) -> NoReturn:
        from skidyn import __version__

        print(f"skidyn {__version__}")
        parser.exit()


def make_parser() -> argparse.ArgumentParser:
    """Parser of the command line.

    Returns
    -------
    argparse.ArgumentParser
        One subparser per command.
    """
    from skidyn._commands import COMMANDS
    from skidyn._commands._terminal import TeachingFormatter

    parser = _Parser(
        prog="skidyn",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=TeachingFormatter,
    )
    parser.add_argument("--version", action=_Version)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for command in COMMANDS:
        command.add_parser(commands)
    return parser


def _open_closed_streams() -> None:
    """Discard output to a closed stream, and print ASCII if the stream supports nothing else."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        elif hasattr(stream, "reconfigure") and stream.errors == "strict":
            stream.reconfigure(errors=PLAIN)


def _give_up_output() -> None:
    """Prevent buffered output from raising again when Python shuts down."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _plainly(error: UnicodeError) -> tuple[str, int]:
    """Replacements of characters that an encoding lacks."""
    assert isinstance(error, UnicodeEncodeError)
    lost = error.object[error.start : error.end]
    return "".join(_SIGNS.get(sign, "?") for sign in lost), error.end


#: Replacements of characters for ASCII output.
_SIGNS = {"±": "+-", "²": "^2", "·": "*", "°": " deg", "→": "->", "–": "-", "—": "-", "µ": "u"}
PLAIN = "skidyn.plain"
codecs.register_error(PLAIN, _plainly)


def _fitting() -> AbstractContextManager[Any]:
    """Fit lines to the width of a terminal; output to a pipe or file is unchanged."""
    from skidyn._commands._terminal import FittingStream

    if not sys.stdout.isatty():
        return nullcontext()
    return redirect_stdout(cast(TextIO, FittingStream(sys.stdout)))


def _complain(text: str) -> None:
    if sys.stderr.isatty():
        from skidyn._commands._terminal import fit

        text = "\n".join(fit(line, get_terminal_size().columns) for line in text.split("\n"))
    print(text, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
