# SPDX-License-Identifier: BSD-3-Clause
"""Compare a wheel with the files under version control: nothing of the package may be left out.

Usage: python .ci/check_wheel.py dist/skidyn-*.whl
"""

import subprocess
import sys
import zipfile


def main(wheel: str) -> int:
    """Return 1 and name the files if some are missing from the wheel, or should not be there."""
    listed = subprocess.run(
        ["git", "ls-files", "skidyn"], capture_output=True, text=True, check=True
    )
    tracked = set(listed.stdout.split())
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("skidyn/")}
    for name in sorted(tracked - packed):
        print(f"missing from the wheel: {name} (see package-data in pyproject.toml)")
    for name in sorted(packed - tracked):
        print(f"in the wheel but not under version control: {name}")
    print(f"{wheel}: {len(packed)} files of the package")
    return int(packed != tracked)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
