# SPDX-License-Identifier: BSD-3-Clause
"""What is public: importable, documented, and on exactly one API page."""

import importlib
import importlib.util
import inspect
from collections import Counter
from pathlib import Path

import skidyn

REPOSITORY = Path(__file__).resolve().parents[1]
SUBMODULES = [
    importlib.import_module(f"skidyn.{name}")
    for name in skidyn.__all__
    if importlib.util.find_spec(f"skidyn.{name}") is not None
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
