# SPDX-License-Identifier: BSD-3-Clause
"""``python -m skidyn`` runs the command line."""

import sys

from skidyn.cli import main

if __name__ == "__main__":
    sys.exit(main())
