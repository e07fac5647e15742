# SPDX-License-Identifier: BSD-3-Clause
"""Docstrings of the public API: complete by the rules of numpydoc, and their examples run."""

import doctest
import importlib
import importlib.util
import inspect
import pkgutil
import tomllib
from pathlib import Path

import pytest

import skidyn

numpydoc_validate = pytest.importorskip("numpydoc.validate", reason="needs skidyn[test]")

REPOSITORY = Path(__file__).resolve().parents[1]
PAGES = sorted(
    page
    for folder in ("docs", "docs/user_guide", "docs/contributing")
    for page in (REPOSITORY / folder).glob("*.rst")
    if ">>>" in page.read_text(encoding="utf-8")
)
MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(skidyn.__path__, "skidyn.")
    if not module.name.endswith("__main__")
)


def required_checks():
    """Codes of the rules, from pyproject.toml so that other tools can read them too."""
    settings = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    return frozenset(settings["tool"]["numpydoc_validation"]["checks"])


def public_objects():
    """Dotted names of public functions and classes, and of the public methods written here."""
    for submodule in skidyn.__all__:
        if importlib.util.find_spec(f"skidyn.{submodule}") is None:
            continue
        module = importlib.import_module(f"skidyn.{submodule}")
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isfunction(thing) or inspect.isclass(thing):
                yield f"{module.__name__}.{name}"
            if inspect.isclass(thing):
                for method, member in vars(thing).items():
                    if not method.startswith("_") and inspect.isfunction(member):
                        yield f"{module.__name__}.{name}.{method}"


@pytest.mark.parametrize("name", sorted(public_objects()))
def test_docstring_is_complete(name):
    result = numpydoc_validate.validate(name)
    failures = [text for code, text in result["errors"] if code in required_checks()]
    assert not failures, "\n".join([f"{result['file']}:{result['file_line']}", *failures])


@pytest.mark.parametrize("name", sorted(n for n in public_objects() if n.count(".") == 2))
def test_public_object_shows_an_example(name):
    module, _, symbol = name.rpartition(".")
    assert ">>>" in inspect.getdoc(getattr(importlib.import_module(module), symbol))


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name):
    module = importlib.import_module(name)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    assert doctest.testmod(module, optionflags=flags).failed == 0


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_examples_of_the_user_guide_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some pages write files
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    result = doctest.testfile(str(page), module_relative=False, optionflags=flags, encoding="utf-8")
    assert result.failed == 0
