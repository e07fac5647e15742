# SPDX-License-Identifier: BSD-3-Clause
"""The commands of the command line: one module each, with ``add_parser`` and ``run``."""

from skidyn._commands import (
    _add,
    _check,
    _compare,
    _completion,
    _demo,
    _diagnose,
    _effects,
    _excite,
    _explore,
    _export,
    _identify,
    _payload,
    _report,
    _separate,
    _simulate,
)

#: In the order in which ``skidyn --help`` lists them: that of the loop.
COMMANDS = (
    _demo,
    _check,
    _compare,
    _diagnose,
    _explore,
    _add,
    _separate,
    _identify,
    _payload,
    _report,
    _excite,
    _export,
    _simulate,
    _effects,
    _completion,
)

__all__ = ["COMMANDS"]
