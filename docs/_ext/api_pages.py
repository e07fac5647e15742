# SPDX-License-Identifier: BSD-3-Clause
"""Write one API page per module from the table in ``docs/api_reference.py``."""

from pathlib import Path
from typing import Any

import api_reference
from sphinx.application import Sphinx


def page_text(page: api_reference.Page) -> str:
    """Text of the page of one module in reStructuredText."""
    lines = [f".. _api_{page.module}:", "", page.module, "=" * len(page.module), ""]
    lines += [f".. automodule:: {page.module}", "   :no-members:", "   :no-index:", ""]
    lines += [f".. currentmodule:: {page.module}", ""]
    for section in page.sections:
        lines += [section.title, "-" * len(section.title), "", ".. autosummary::"]
        lines += ["   :toctree: .", "   :nosignatures:", ""]
        lines += [f"   {name}" for name in section.names] + [""]
    return "\n".join(lines)


def index_text(pages: tuple[api_reference.Page, ...]) -> str:
    """Text of the overview of all modules."""
    lines = [".. list-table::", "   :widths: 30 70", ""]
    for page in pages:
        lines += [f"   * - :ref:`{page.module} <api_{page.module}>`", f"     - {page.sentence}"]
    lines += ["", ".. toctree::", "   :hidden:", "", *(f"   {page.module}" for page in pages), ""]
    return "\n".join(lines)


def write(path: Path, text: str) -> None:
    """Write only what changed, so that an unchanged page is not built again."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def write_pages(app: Sphinx, config: Any) -> None:
    """Write the pages before Sphinx looks for documents."""
    folder = Path(app.srcdir) / "api"
    for page in api_reference.PAGES:
        write(folder / f"{page.module}.rst", page_text(page))
    title = "API reference\n=============\n\nEvery public name, module by module.\n\n"
    write(folder / "index.rst", title + index_text(api_reference.PAGES))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("config-inited", write_pages)
    return {"parallel_read_safe": True}
