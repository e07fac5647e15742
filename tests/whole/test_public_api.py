# SPDX-License-Identifier: BSD-3-Clause
"""What is public: importable, documented, and on exactly one API page."""

import doctest
import importlib
import importlib.util
import inspect
import tomllib
from collections import Counter
from pathlib import Path

import pytest

import skidyn

REPOSITORY = Path(__file__).resolve().parents[2]
SUBMODULES = [
    importlib.import_module(f"skidyn.{name}")
    for name in skidyn.__all__
    if importlib.util.find_spec(f"skidyn.{name}") is not None
]
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


def api_pages():
    """The table from which the API pages are generated."""
    source = REPOSITORY / "docs" / "api_reference.py"
    specification = importlib.util.spec_from_file_location("api_reference", source)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return {page.module: page for page in module.PAGES}


def test_all_of_the_package_is_there():
    for name in skidyn.__all__:
        assert getattr(skidyn, name) is not None
    assert dir(skidyn) == skidyn.__all__


def test_all_of_every_module_is_there():
    assert [module.__name__ for module in SUBMODULES if not module.__doc__] == []
    missing = [(m.__name__, name) for m in SUBMODULES for name in m.__all__ if not hasattr(m, name)]
    assert missing == []


def test_every_public_symbol_is_documented():
    things = {f"{m.__name__}.{name}": getattr(m, name) for m in SUBMODULES for name in m.__all__}
    assert [n for n, thing in things.items() if callable(thing) and not inspect.getdoc(thing)] == []


def test_every_public_symbol_is_on_its_api_page_once():
    pages = api_pages()
    without = [module.__name__ for module in SUBMODULES if module.__name__ not in pages]
    assert without == [], "add pages to docs/api_reference.py"
    for module in SUBMODULES:
        page = pages[module.__name__]
        listed = Counter(symbol for section in page.sections for symbol in section.names)
        assert listed == Counter(module.__all__), "docs/api_reference.py and __all__ differ"


def test_every_source_file_states_its_licence():
    sources = REPOSITORY.glob("skidyn/**/*.py")
    licence = "# SPDX-License-Identifier: BSD-3-Clause"
    assert [s for s in sources if not s.read_text(encoding="utf-8").startswith(licence)] == []


def required_checks():
    """Codes of the rules, from pyproject.toml so that other tools can read them too."""
    settings = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    return frozenset(settings["tool"]["numpydoc_validation"]["checks"])


def public_objects():
    """Dotted names of public functions and classes, and of the public methods written here."""
    for module in SUBMODULES:
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isfunction(thing) or inspect.isclass(thing):
                yield f"{module.__name__}.{name}"
            if inspect.isclass(thing):
                for method, member in vars(thing).items():
                    if not method.startswith("_") and inspect.isfunction(member):
                        yield f"{module.__name__}.{name}.{method}"


def test_every_docstring_is_complete():
    validate = pytest.importorskip("numpydoc.validate", reason="needs skidyn[test]").validate
    results, required = map(validate, sorted(public_objects())), required_checks()
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
