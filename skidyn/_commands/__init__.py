# SPDX-License-Identifier: BSD-3-Clause
"""The commands of the command line: one module each, with ``add_parser`` and ``run``."""

from importlib import import_module

#: In the order in which ``skidyn --help`` lists them: that of the loop.
_NAMES = """
demo check compare diagnose explore add separate identify payload report excite export simulate
effects completion
"""

COMMANDS = tuple(import_module(f"skidyn._commands._{name}") for name in _NAMES.split())

__all__ = ["COMMANDS"]
