# SPDX-License-Identifier: BSD-3-Clause
"""Wheel and source archive: built, installed into an empty environment, and run from there."""

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
#: Beside the package, what setuptools needs to build it, and what it writes into an archive.
TO_BUILD = {"LICENSE", "MANIFEST.in", "README.md", "pyproject.toml", "setup.cfg", "PKG-INFO"}

# Nothing is fetched: the build runs in this environment.
pytest.importorskip("setuptools", minversion="77", reason="builds with setuptools 77")
pytest.importorskip("pip")
pytestmark = pytest.mark.slow


def run(*words, **options):
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [*map(str, words)], capture_output=True, text=True, env=environment, **options
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """The files under version control, and those that will be, in a folder of their own."""
    if shutil.which("git") is None or not (REPOSITORY / ".git").exists():
        pytest.skip("needs a checkout of the repository, to know what belongs into the package")
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    folder = tmp_path_factory.mktemp("source")
    for name in run(*words, cwd=REPOSITORY).splitlines():
        if name.startswith("skidyn/") or "/" not in name:
            if (REPOSITORY / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(REPOSITORY / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def package(source):
    """Names of all files of the package."""
    return {f.relative_to(source).as_posix() for f in source.glob("skidyn/**/*") if f.is_file()}


def build(kind, source, out):
    code = f"import sys; from setuptools.build_meta import build_{kind} as b; print(b(sys.argv[1]))"
    return out / run(sys.executable, "-c", code, out, cwd=source).splitlines()[-1]


@pytest.fixture(scope="module", params=["wheel", "sdist"])
def archive(request, source, package, tmp_path_factory):
    """A path to it; building leaves the names of the package in the source as they are."""
    return build(request.param, source, tmp_path_factory.mktemp(request.param))


def test_it_holds_the_package_and_nothing_else(archive, package):
    if archive.suffix == ".whl":
        names = zipfile.ZipFile(archive).namelist()
        beside = {n for n in names if not n.startswith("skidyn/")}
        assert all(n.startswith(f"{archive.name.split('-py3')[0]}.dist-info/") for n in beside)
    else:
        with tarfile.open(archive) as tar:
            members = [m for m in tar.getmembers() if m.isfile()]
        assert {m.uname for m in members} == {"root"}  # says nothing about who built it
        names = [m.name.partition("/")[2] for m in members]
        beside = {n for n in names if not n.startswith("skidyn/")}
        assert {n for n in beside if not n.startswith("skidyn.egg-info/")} == TO_BUILD
    assert set(names) - beside == package
    assert {"skidyn/py.typed", "skidyn/static/uPlot.js"} <= package
    assert "skidyn/datasets/robots/panda.urdf" in package


def test_it_runs_from_an_empty_environment(archive, tmp_path):
    venv.create(tmp_path / "env")
    python = tmp_path / "env" / "bin" / "python"
    if not python.exists():
        python = tmp_path / "env" / "Scripts" / "python.exe"
    packages = Path(
        run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip()
    )
    # Its dependencies are those of this environment, whose own skidyn comes after.
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    pip = [sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check"]
    run(*pip, "install", "--quiet", "--no-index", "--no-deps", "--no-build-isolation",
        "--ignore-installed", archive, cwd=tmp_path)  # fmt: skip
    code = (
        "import skidyn, sys, importlib.resources as r\n"
        "from skidyn.datasets import load_panda\n"
        "assert load_panda().n_joints == 7\n"
        "assert r.files('skidyn').joinpath('py.typed').is_file()\n"
        "assert 'uPlot' in r.files('skidyn').joinpath('static/uPlot.js').read_text()\n"
        "print(skidyn.__file__)"
    )
    used = run(python, "-I", "-c", code, cwd=tmp_path).strip()
    assert Path(used).is_relative_to(packages)
    command = python.parent / f"skidyn{python.suffix}"
    version = distribution("skidyn").version
    assert version in run(command, "--version", cwd=tmp_path)
    made = {p.name for p in packages.iterdir()} - {"dependencies.pth", "__pycache__"}
    assert made == {"skidyn", f"skidyn-{version}.dist-info"}
