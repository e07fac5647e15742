# SPDX-License-Identifier: BSD-3-Clause
"""Link the labels of scikit-learn's documentation that inherited docstrings refer to."""

from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

SITE = "https://scikit-learn.org/stable/"
LABELS = {
    "metadata_routing": f"{SITE}metadata_routing.html",
    "r2_score": f"{SITE}modules/model_evaluation.html#r2-score",
}


def link(app: Sphinx, env: Any, node: Any, text: nodes.TextElement) -> nodes.reference | None:
    """Give the address of a known label; None leaves the warning to Sphinx."""
    address = LABELS.get(node.get("reftarget")) if node.get("reftype") == "ref" else None
    if address is None:
        return None
    return nodes.reference("", "", text, refuri=address, internal=False)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("missing-reference", link)
    return {"parallel_read_safe": True}
