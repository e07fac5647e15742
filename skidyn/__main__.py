# SPDX-License-Identifier: BSD-3-Clause
"""The command line for ``python -m skidyn`` and the script ``skidyn``."""

import gc
import sys

#: New objects after which Python looks for unreachable ones. Imports and programs of robots make
#: hundreds of thousands that stay, so that its default takes a twentieth of the time of a command.
MANY_OBJECTS = 10_000


def main() -> int:
    """Import and run the command line; Ctrl-C ends either with one line."""
    try:  # here, since only this process is the command's own
        gc.set_threshold(MANY_OBJECTS, 10, 10)
        from skidyn.cli import main as run

        return run()
    except KeyboardInterrupt:
        print("stopped; no file was left incomplete", file=sys.stderr)
        return 130
    finally:
        gc.freeze()  # the end of Python would look through all objects three times


if __name__ == "__main__":
    sys.exit(main())
