# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn completion``: the script for completion in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from skidyn._commands._arguments import Input, Output, command
from skidyn._commands._export import SUFFIXES
from skidyn._commands._input import embedded_robots
from skidyn._commands._output import print_json

DESCRIPTION = """\
Print a script for shell completion of commands, options, files, and kinds of effects, including
comma-separated lists.

  skidyn completion bash > ~/.local/share/bash-completion/completions/skidyn
  skidyn completion zsh > "${fpath[1]}/_skidyn"

To try it in a running bash:

  source <(skidyn completion bash)

The script is generated once and needs no Python afterwards. Generating it requires shtab: pip
install skidyn[shell]
"""

#: Kinds of values of arguments, by their names in the options; all other files by their type. Words
#: with an s may be several, separated by commas.
WORDS = {
    "effect": "kind", "finding": "kind", "rival": "kind", "model": "kinds", "effects": "kinds",
    "against_model": "kinds", "format": "formats", "robot": "robot",
}  # fmt: skip

#: Functions of the shells; the one for several values keeps the text before a comma.
_BASH = """\
_skidyn_NAME() { compgen -W "WORDS" -- "$1"; }
_skidyn_NAMEs() {
  local head=""
  [[ "$1" == *,* ]] && head="${1%,*},"
  compgen -P "$head" -W "WORDS" -- "${1##*,}"
}
"""
_ZSH = """\
_skidyn_NAME() { compadd -- WORDS }
_skidyn_NAMEs() { _sequence compadd - WORDS }
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands, "completion", run, "print the script for completion in a shell", DESCRIPTION
    )
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


def run(options: argparse.Namespace) -> None:
    from skidyn._optional import import_optional
    from skidyn.cli import make_parser
    from skidyn.effects import list_effects

    shtab = import_optional("shtab", extra="shell")
    known = {
        "kind": ["rigid_body", *list_effects()],
        "format": list(SUFFIXES),
        "robot": embedded_robots(),
    }
    parser = make_parser()
    for action in _actions(parser):
        if action.dest in WORDS:
            name = WORDS[action.dest]
            function, words = f"_skidyn_{name}", f"({' '.join(known[name.removesuffix('s')])})"
            action.complete = {"bash": function, "zsh": function, "tcsh": words}
        elif isinstance(action.type, type) and issubclass(action.type, (Input, Output)):
            action.complete = shtab.FILE
        elif action.dest == "folder":
            action.complete = shtab.DIRECTORY
    preamble = {
        shell: "".join(
            text.replace("NAME", name).replace("WORDS", " ".join(words))
            for name, words in known.items()
        )
        for shell, text in (("bash", _BASH), ("zsh", _ZSH))
    }
    script = shtab.complete(parser, shell=options.shell, preamble=preamble)
    # shtab writes "one or more" in a form that zsh interprets as "one"
    script = script.replace('"(*):', '"*:') if options.shell == "zsh" else script
    if options.json:
        print_json({"shell": options.shell, "script": script})
    else:
        print(script)


def _actions(parser: argparse.ArgumentParser) -> Iterator[Any]:
    """Arguments of all commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for short in action._choices_actions:  # zsh shows the first line of the description
                action.choices[short.dest].description = short.help
            for command in action.choices.values():
                yield from _actions(command)
