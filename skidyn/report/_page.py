# SPDX-License-Identifier: BSD-3-Clause
"""What the pages share: templates, filters, and everything a page carries inside itself."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import Any

import numpy as np

from skidyn._bundled import bundled
from skidyn._optional import import_optional
from skidyn._text import digits, raised
from skidyn.report._glossary import meaning

#: Error over noise that has the strongest colour of an error map.
DEEPEST = 5.0
#: In this order: each script uses what the ones before it define.
SCRIPTS = ("common.js", "figures.js", "panels.js")


def render_page(template: str, **content: Any) -> str:
    """Fill a template of ``skidyn/report/templates``; every text in it is escaped.

    Parameters
    ----------
    template : str
        Name of the template.
    **content : object
        Its variables; ``numbers`` is what the scripts draw.

    Returns
    -------
    html : str
        A page that loads nothing from anywhere: styles, scripts and numbers are inside.
    """
    jinja2 = import_optional("jinja2", extra="report")
    # autoescape: the safeguard against names of joints that hold markup; inside the script
    # `tojson` does it
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: _resource("templates", name)),
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    environment.filters.update(
        number=number,
        percent=percent,
        change=change,
        chance=chance,
        words=words,
        raised=raised,
        capital=capital,
        short=short,
        mathml=mathml,
        meaning=meaning,
    )
    return str(
        environment.get_template(template).render(
            css=bundled("uPlot.css") + _resource("static", "page.css"),
            uplot=bundled("uPlot.js"),
            licence=bundled("uPlot.LICENSE.txt"),
            js="\n".join(_resource("static", name) for name in SCRIPTS),
            **content,
        )
    )


def _resource(folder: str, name: str) -> str:
    return resources.files("skidyn.report").joinpath(folder, name).read_text(encoding="utf-8")


def number(value: Any) -> str:
    """Three or four digits; a dash where there is no number."""
    if value is None:
        return "–"
    return f"{value:.4g}".replace("-", "−") if isinstance(value, (int, float)) else str(value)


def percent(value: float | None) -> str:
    """Share in whole per cent."""
    return "–" if value is None else f"{value:.0%}"


def change(ratio: float) -> str:
    """Relative change in per cent, with a sign only where something changed."""
    rounded = round(100 * ratio)
    return f"{rounded:+d}%".replace("-", "−") if rounded else "0%"


def words(kind: str) -> str:
    """Kind of the vocabulary as words."""
    return "effect without a name" if kind == "unknown" else kind.replace("_", " ")


def chance(q_value: float | None) -> str:
    """A q-value; digits far below what any model of the noise can promise are not shown."""
    return "below 1e-15" if q_value is not None and q_value < 1e-15 else number(q_value)


def packed(values: Iterable[float | None]) -> str:
    """Base64 of 32-bit floats, a fifth of their size as text; NaN where there is no number."""
    array = np.array([np.nan if v is None else v for v in values], dtype="<f4")
    return base64.b64encode(array.tobytes()).decode("ascii")


def short(value: float | None) -> str:
    """Two significant digits; a dash where there is no number."""
    return "–" if value is None else digits(value).replace("-", "−")


def capital(text: str) -> str:
    """Text with a capital first letter."""
    return text[:1].upper() + text[1:]


def mathml(formula: str) -> Any:
    """A formula in LaTeX as MathML, which browsers draw themselves."""
    convert = import_optional("latex2mathml.converter", extra="report").convert
    markup = import_optional("markupsafe", extra="report").Markup
    return markup(convert(formula.replace(r"\mathrm{sign}", r"\operatorname{sign}")))


def heat(
    table: list[list[float | None]],
    noise: Sequence[float | None],
    judged: Sequence[Sequence[bool]] | None = None,
) -> list[list[dict[str, Any]]]:
    """Cells of an error map; the colour is the error over the noise of the joint.

    Parameters
    ----------
    table : list of list of float or None
        Errors by joint and regime.
    noise : sequence of float or None
        Noise of the joints.
    judged : sequence of sequence of bool, optional
        Whether effects are judged there, by joint and regime; everywhere by default.

    Returns
    -------
    list of list of dict
        ``value``, ``depth`` between 0 (noise) and 1, and ``judged``.
    """
    rows = []
    for j, row in enumerate(table):
        floor = noise[j]
        cells = []
        for k, value in enumerate(row):
            ratio = 1.0 if value is None or not floor else value / floor
            depth = min(max((ratio - 1) / (DEEPEST - 1), 0.0), 1.0)
            counts = True if judged is None else judged[j][k]
            cells.append({"value": value, "depth": round(depth, 2), "judged": counts})
        rows.append(cells)
    return rows
