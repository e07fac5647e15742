# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn completion``: the script with which a shell completes skidyn's words."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from skidyn._commands._terminal import TeachingFormatter

DESCRIPTION = """\
Print the script with which a shell completes commands, options, files, and kinds of effects, also
in lists with commas.

  skidyn completion bash > ~/.local/share/bash-completion/completions/skidyn
  skidyn completion zsh > "${fpath[1]}/_skidyn"

To try it in a running bash:

  source <(skidyn completion bash)

The script is made once and costs nothing afterwards. It needs shtab: pip install skidyn[shell]
"""

#: What the values of arguments are, by their names in the options.
FILES = ("logs", "urdf", "report", "out", "html", "against", "unloaded")
KIND = ("effect", "finding", "rival")
KIND_LISTS = ("model", "effects", "against_model")

#: Functions of the shells that complete kinds; the second keeps what stands before a comma.
_BASH = """\
_skidyn_kind() { compgen -W "KINDS" -- "$1"; }
_skidyn_kinds() {
  local head=""
  [[ "$1" == *,* ]] && head="${1%,*},"
  compgen -P "$head" -W "KINDS" -- "${1##*,}"
}
"""
_ZSH = """\
_skidyn_kind() { compadd -- KINDS }
_skidyn_kinds() { _sequence compadd - KINDS }
"""


def add_parser(commands: Any) -> None:
    parser = commands.add_parser(
        "completion",
        help="print the script for completion in a shell",
        description=DESCRIPTION,
        formatter_class=TeachingFormatter,
    )
    parser.set_defaults(run=run)
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


def run(options: argparse.Namespace) -> None:
    from skidyn._optional import import_optional
    from skidyn.cli import make_parser
    from skidyn.effects import list_effects

    shtab = import_optional("shtab", extra="shell")
    kinds = " ".join(["rigid_body", *list_effects()])
    words = f"({kinds})"
    parser = make_parser()
    for action in _actions(parser):
        if action.dest in FILES:
            action.complete = shtab.FILE
        elif action.dest == "folder":
            action.complete = shtab.DIRECTORY
        elif action.dest in (*KIND, *KIND_LISTS):
            function = "_skidyn_kind" if action.dest in KIND else "_skidyn_kinds"
            action.complete = {"bash": function, "zsh": function, "tcsh": words}
    preamble = {"bash": _BASH, "zsh": _ZSH}
    preamble = {shell: text.replace("KINDS", kinds) for shell, text in preamble.items()}
    script = shtab.complete(parser, shell=options.shell, preamble=preamble)
    # shtab writes "one or more" so that zsh takes it for "one"
    print(script.replace('"(*):', '"*:') if options.shell == "zsh" else script)


def _actions(parser: argparse.ArgumentParser) -> Iterator[Any]:
    """Arguments of all commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for short in action._choices_actions:  # zsh shows the first line of the description
                action.choices[short.dest].description = short.help
            for command in action.choices.values():
                yield from _actions(command)
