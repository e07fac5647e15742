# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn completion``: the script with which a shell completes skidyn's words."""

from __future__ import annotations

import argparse
from typing import Any

DESCRIPTION = """\
Print the script with which a shell completes commands, options and file names.

  skidyn completion bash > ~/.local/share/bash-completion/completions/skidyn
  skidyn completion zsh > "${fpath[1]}/_skidyn"

The script is made once and costs nothing afterwards. It needs shtab: pip install skidyn[shell]
"""


def add_parser(commands: Any) -> None:
    parser = commands.add_parser(
        "completion",
        help="print the script for completion in a shell",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


def run(options: argparse.Namespace) -> None:
    from skidyn._optional import import_optional
    from skidyn.cli import make_parser

    shtab = import_optional("shtab", extra="shell")
    print(shtab.complete(make_parser(), shell=options.shell))
