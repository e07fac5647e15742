# SPDX-License-Identifier: BSD-3-Clause
"""Docstrings of the public API: complete by the rules of numpydoc, and their examples run."""

import doctest
import importlib
import importlib.util
import inspect
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
#: Modules in whose docstrings something is run.
MODULES = sorted(
    ".".join(source.relative_to(REPOSITORY).with_suffix("").parts).removesuffix(".__init__")
    for source in (REPOSITORY / "skidyn").rglob("*.py")
    if ">>>" in source.read_text(encoding="utf-8")
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


def test_every_docstring_is_complete():
    results, required = map(numpydoc_validate.validate, sorted(public_objects())), required_checks()
    failures = [
        f"{result['file']}:{result['file_line']} {text}"
        for result in results
        for code, text in result["errors"]
        if code in required
    ]
    assert not failures, "\n".join(failures)


def test_every_public_object_shows_an_example():
    without = []
    for name in sorted(n for n in public_objects() if n.count(".") == 2):
        module, _, symbol = name.rpartition(".")
        if ">>>" not in inspect.getdoc(getattr(importlib.import_module(module), symbol)):
            without.append(name)
    assert not without


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
