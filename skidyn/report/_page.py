# SPDX-License-Identifier: BSD-3-Clause
"""Pages made of their pictures: templates, filters, and embedded scripts and styles."""

from __future__ import annotations

from importlib import resources
from typing import Any

from skidyn._bundled import bundled
from skidyn._optional import import_optional
from skidyn._text import counted, digits, inside, joints_told, listed, raised
from skidyn.effects import get_effect, list_effects
from skidyn.report._glossary import meaning
from skidyn.report._picture import Canvas, Summary, pictures

#: In this order: each script uses what the ones before it define.
SCRIPTS = ("static/common.js", "static/figures.js", "static/panels.js")


def render_page(page: str, summary: Summary, sub: str) -> str:
    """A page from the data of its pictures, with ``sub`` below its title; every text is escaped."""
    environment = _environment()
    canvas, parts, contents, scripts = Canvas(), [], [], list(SCRIPTS)
    for name, picture in pictures(page).items():
        content = picture.show(summary, canvas)
        if content is None:
            continue
        beside = "/".join(type(picture).__module__.split(".")[2:])
        template = environment.get_template(f"{beside}.html.jinja")
        parts.append(template.render(s=summary, r=summary["report"], **content))
        contents += [(name, picture.title)] if picture.title else []
        script = resources.files("skidyn.report").joinpath(f"{beside}.js")
        scripts += [f"{beside}.js"] if script.is_file() else []
    return str(
        environment.get_template("templates/page.html.jinja").render(
            title=summary["title"],
            eyebrow=f"skidyn {page}",
            sub=sub,
            contents=contents,
            parts=parts,
            numbers=canvas.numbers,
            css=bundled("uPlot.css") + _resource("static/page.css"),
            uplot=bundled("uPlot.js"),
            licence=bundled("uPlot.LICENSE.txt"),
            js="\n".join(map(_resource, scripts)),
        )
    )


def _environment() -> Any:
    """Templates below ``skidyn/report``, with the filters that write numbers and words."""
    jinja2 = import_optional("jinja2", extra="report")
    # autoescape is the safeguard against names of joints with markup; inside the script `tojson` is
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_resource),
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    own = number, percent, change, chance, words, breakable, capital, short, mathml, counted
    for told in (*own, joints_told, listed, meaning, raised):
        environment.filters[told.__name__] = told
    return environment


def _resource(name: str) -> str:
    """A file below ``skidyn/report``, by its path with slashes."""
    return resources.files("skidyn.report").joinpath(*name.split("/")).read_text(encoding="utf-8")


def number(value: Any) -> str:
    """Three or four digits; a dash if there is no number."""
    if value is None:
        return "–"
    return f"{value:.4g}".replace("-", "−") if isinstance(value, (int, float)) else str(value)


def percent(value: float | None) -> str:
    """Share in whole per cent."""
    return "–" if value is None else f"{value:.0%}"


def change(ratio: float) -> str:
    """Relative change in per cent, with a sign only if it is not zero."""
    rounded = round(100 * ratio)
    return f"{rounded:+d}%".replace("-", "−") if rounded else "0%"


def words(kind: str) -> str:
    """Title of a kind for a sentence; other words are written without underscores."""
    if kind == "unknown":
        return "unknown effect"
    return inside(get_effect(kind).title) if kind in list_effects() else kind.replace("_", " ")


def chance(q_value: float | None) -> str:
    """A q-value, without digits far below the accuracy of any noise model."""
    return "below 1e-15" if q_value is not None and q_value < 1e-15 else number(q_value)


def short(value: float | None) -> str:
    """Two significant digits; a dash if there is no number."""
    return "–" if value is None else digits(value).replace("-", "−")


def capital(text: str) -> str:
    """Text with a capital first letter."""
    return text[:1].upper() + text[1:]


def breakable(name: str) -> Any:
    """A name with line breaks permitted after underscores and commas, not inside a word."""
    markup = import_optional("markupsafe", extra="report").Markup
    parts = (markup("_<wbr>").join(part.split("_")) for part in name.split(","))
    return markup(",<wbr>").join(parts)


def mathml(formula: str) -> Any:
    """A formula in LaTeX as MathML, which browsers can display."""
    convert = import_optional("latex2mathml.converter", extra="report").convert
    markup = import_optional("markupsafe", extra="report").Markup
    return markup(convert(formula.replace(r"\mathrm{sign}", r"\operatorname{sign}")))
