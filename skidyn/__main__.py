# SPDX-License-Identifier: BSD-3-Clause
"""The command line for ``python -m skidyn`` and the script ``skidyn``."""

import gc
import sys


def main() -> int:
    """Import and run the command line; Ctrl-C ends either with one line."""
    try:
        from skidyn.cli import main as run

        return run()
    except KeyboardInterrupt:
        print("stopped; no file was left incomplete", file=sys.stderr)
        return 130
    finally:
        gc.freeze()  # the end of Python would look through all objects three times


if __name__ == "__main__":
    sys.exit(main())
