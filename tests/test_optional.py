# SPDX-License-Identifier: BSD-3-Clause
"""A package that only some users need."""

import pytest

from skidyn._optional import import_optional


def test_missing_optional_package_names_the_extra():
    with pytest.raises(ImportError, match=r"pip install 'skidyn\[plot\]'"):
        import_optional("no_such_package_of_skidyn.pyplot", extra="plot")


def test_broken_optional_package_is_not_called_missing(tmp_path, monkeypatch):
    (tmp_path / "broken_optional.py").write_text("import no_such_dependency\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="no_such_dependency"):
        import_optional("broken_optional", extra="plot")
