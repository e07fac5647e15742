# SPDX-License-Identifier: BSD-3-Clause
"""Print the oldest version that pyproject.toml allows of every dependency, as pins for pip.

Usage: python .ci/oldest.py EXTRA... > constraints.txt

torch is left out: it is installed before, in the build that was asked for.
"""

import re
import sys
import tomllib
from pathlib import Path

#: What our dependencies need and do not say: matplotlib before 3.10.8 makes newer ones warn.
OTHERS = ["pyparsing<3.3"]
NAME_AND_FLOOR = re.compile(r"([A-Za-z0-9._-]+)\s*>=\s*([0-9.]+)")


def main(extras: list[str]) -> None:
    """Print the oldest version of every package that the extras allow."""
    project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
    wanted, seen = list(project["dependencies"]), set()
    while extras:
        extra = extras.pop()
        if extra in seen:
            continue
        seen.add(extra)
        for requirement in project["optional-dependencies"][extra]:
            nested = re.fullmatch(r"skidyn\[(.*)\]", requirement)
            extras += nested[1].split(",") if nested else []
            wanted += [] if nested else [requirement]
    for requirement in sorted(set(wanted)):
        found = NAME_AND_FLOOR.match(requirement)
        if found and found[1] != "torch":
            print(f"{found[1]}=={found[2]}")
    print(*OTHERS, sep="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
