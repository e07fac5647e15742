# SPDX-License-Identifier: BSD-3-Clause
"""What is public: importable, documented, and on exactly one API page."""

import importlib
import importlib.util
import inspect
from collections import Counter
from pathlib import Path

import pytest

import skidyn

REPOSITORY = Path(__file__).resolve().parents[1]
SUBMODULES = [
    name for name in skidyn.__all__ if importlib.util.find_spec(f"skidyn.{name}") is not None
]


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


@pytest.mark.parametrize("name", SUBMODULES)
def test_all_of_a_module_is_there(name):
    module = importlib.import_module(f"skidyn.{name}")
    assert module.__doc__
    missing = [symbol for symbol in module.__all__ if not hasattr(module, symbol)]
    assert not missing


@pytest.mark.parametrize("name", SUBMODULES)
def test_every_public_symbol_is_documented(name):
    module = importlib.import_module(f"skidyn.{name}")
    without = [
        symbol
        for symbol in module.__all__
        if callable(getattr(module, symbol)) and not inspect.getdoc(getattr(module, symbol))
    ]
    assert not without


@pytest.mark.parametrize("name", SUBMODULES)
def test_every_public_symbol_is_on_its_api_page_once(name):
    module = importlib.import_module(f"skidyn.{name}")
    page = api_pages().get(f"skidyn.{name}")
    assert page is not None, f"add a page for skidyn.{name} to docs/api_reference.py"
    listed = Counter(symbol for section in page.sections for symbol in section.names)
    assert set(listed) == set(module.__all__), "docs/api_reference.py and __all__ differ"
    assert max(listed.values()) == 1


@pytest.mark.parametrize(
    "source",
    sorted(REPOSITORY.glob("skidyn/**/*.py")),
    ids=lambda path: str(path.relative_to(REPOSITORY)),
)
def test_every_source_file_states_its_licence(source):
    assert source.read_text(encoding="utf-8").startswith("# SPDX-License-Identifier: BSD-3-Clause")
