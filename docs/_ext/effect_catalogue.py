# SPDX-License-Identifier: BSD-3-Clause
"""The directive ``effect-catalogue``: every effect of skidyn as its class declares it."""

import inspect
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from skidyn.effects import Effect, get_effect, list_effects

_SCOPES = {"joint": "one joint", "pair": "a pair of joints", "robot": "the whole robot"}
_SIGNS = {0: "any sign", 1: "not negative"}


def links(kinds: list[str]) -> str:
    """References to other effects of this page."""
    return ", ".join(f":ref:`{kind} <effect_{kind}>`" for kind in kinds)


def facts(effect: dict[str, Any]) -> list[tuple[str, str]]:
    """Name and text of every line of an effect's table, empty ones left out."""
    fitted = "; ".join(
        f"``{name}`` in {unit or 'no unit'}, {_SIGNS[sign]}"
        for name, unit, sign in effect["coefficients"]
    )
    searched = "; ".join(
        f"``{name}`` in {unit or 'no unit'}, {low:g} to {high:g}"
        for name, unit, low, high in effect["shapes"]
    )
    rows = [
        ("Kind", f"``{effect['kind']}``"),
        ("Acts on", _SCOPES[effect["scope"]]),
        ("Coefficients", fitted),
        ("Shape parameters", searched),
        ("Needs", ", ".join(effect["needs"])),
        ("Easily confused with", links(effect["rivals"])),
        ("Motion that tells them apart", effect["separating_motion"]),
        ("Reference", effect["reference"]),
    ]
    return [(name, text) for name, text in rows if text]


def own_effects() -> list[Effect]:
    """Effects of the package, without those that an example of the gallery has registered."""
    effects = (get_effect(kind) for kind in list_effects())
    return [effect for effect in effects if type(effect).__module__.startswith("skidyn.")]


def overview(effects: list[Effect]) -> str:
    """Table of all effects in reStructuredText."""
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 32 48 20", ""]
    lines += ["   * - Kind", "     - Torque", "     - Acts on"]
    for effect in effects:
        lines += [f"   * - :ref:`{effect.kind} <effect_{effect.kind}>`"]
        lines += [f"     - :math:`{effect.formula}`", f"     - {_SCOPES[effect.scope]}"]
    return "\n".join([*lines, "", ""])


def entry(effect: Effect) -> str:
    """One effect in reStructuredText."""
    declared = effect.describe()
    lines = [f".. _effect_{effect.kind}:", "", effect.title, "-" * len(effect.title), ""]
    lines += [inspect.getdoc(type(effect)) or "", ""]
    lines += [".. math::", "", f"   {effect.formula}", ""]
    lines += [".. list-table::", "   :widths: 28 72", "   :class: effect", ""]
    for name, text in facts(declared):
        lines += [f"   * - {name}", f"     - {text}"]
    return "\n".join([*lines, "", ""])


class EffectCatalogue(SphinxDirective):
    """All effects of the catalogue, in its order."""

    def run(self) -> list[nodes.Node]:
        """Parse the catalogue as if it were written in the page."""
        effects = own_effects()
        text = overview(effects) + "".join(map(entry, effects))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.add_directive("effect-catalogue", EffectCatalogue)
    return {"parallel_read_safe": True}
