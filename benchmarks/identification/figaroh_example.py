# SPDX-License-Identifier: BSD-3-Clause
"""figaroh's own example of a TX40, run as published, with the installed figaroh.

    git clone https://github.com/thanhndv212/figaroh-examples
    python benchmarks/identification/figaroh_example.py figaroh-examples

The example's configuration has an older format, which figaroh's own tool converts, and the URDF
names meshes that are not in the repository, so that visual and collision elements are removed. All
else is the example's: data, filters, sampling and the call of ``solve``. The example of a UR10,
with simulated data, does not run with figaroh 1.0.2: it imports ``get_param_from_yaml``, which that
version no longer has.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from contextlib import redirect_stdout
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

from figaroh.tools.robot import load_robot
from figaroh.utils import config_migration


def without_meshes(urdf: Path, target: Path) -> None:
    """Write a URDF without the elements that name meshes."""
    tree = ElementTree.parse(urdf)
    for link in tree.iter("link"):
        for name in ("visual", "collision"):
            for element in link.findall(name):
                link.remove(element)
    tree.write(target)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("checkout", type=Path, help="of figaroh-examples")
    checkout = parser.parse_args().checkout.resolve()
    example = checkout / "examples" / "staubli_TX40"
    sys.path.insert(0, str(checkout))
    from examples.staubli_TX40.utils.staubli_tx40_tools import TX40Identification

    with tempfile.TemporaryDirectory() as name, redirect_stdout(sys.stderr):
        config = Path(name, "tx40", "config", "tx40.yaml")  # refers to ../../templates
        shutil.copytree(checkout / "examples" / "templates", Path(name, "templates"))
        config.parent.mkdir(parents=True)
        urdf = Path(name, "tx40.urdf")
        without_meshes(example / "urdf" / "tx40_mdh_modified.urdf", urdf)
        words = ["--input", str(example / "config" / "TX40_config.yaml"), "--output", str(config)]
        config_migration.main(words)
        os.chdir(example)  # the example reads its data from there
        found = TX40Identification(load_robot(str(urdf)), str(config))
        found.initialize()
        found.solve(decimate=True, plotting=False, save_results=False, wls=False)
    print(f"figaroh {version('figaroh')}, example of the TX40")
    print(f"  base parameters        {len(found.params_base)}")
    for name, value in found.result.items():
        if isinstance(value, int | float):
            print(f"  {name:22s} {value:.6g}")
    print(f"  {'correlation':22s} {found.correlation:.4f}")


if __name__ == "__main__":
    main()
