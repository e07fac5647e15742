# SPDX-License-Identifier: BSD-3-Clause
"""Sphinx configuration."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE)]

import skidyn  # noqa: E402
from skidyn.effects import list_effects, unregister_effect  # noqa: E402

project = "skidyn"
author = "The skidyn developers"
copyright = "2026, the skidyn developers"
release = skidyn.__version__
version = release

extensions = [
    "api_pages",
    "effect_catalogue",
    "mathml_math",
    "myst_parser",
    "numpydoc",
    "sklearn_labels",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
templates_path = ["_templates"]
exclude_patterns = ["_build", "**.ipynb_checkpoints", "gallery/**/*.md5", "gallery/**/*.ipynb"]
nitpicky = False
default_role = "code"

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"  # numpydoc sections say it better, with units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_math_renderer = "mathml"
html_theme = "pydata_sphinx_theme"
html_title = "skidyn"
html_static_path = ["_static"]
html_css_files = ["skidyn.css"]
html_favicon = "_static/logo.svg"
html_show_sourcelink = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"image_light": "_static/logo.svg", "image_dark": "_static/logo.svg", "text": "skidyn"},
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "show_prev_next": True,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
    "back_to_top_button": False,
}
html_sidebars = {"index": [], "installation": [], "faq": [], "comparison": [], "changelog": []}

copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
myst_heading_anchors = 3

# Examples that need recordings or packages that are absent are shown but not run. They must not be
# started: an example that ends early by sys.exit would end the documentation build with it.
_recordings = os.environ.get("SKIDYN_DATA") or HERE.parents[1] / "shared" / "data"
_not_run = [
    example
    for example, package in {
        "plot_mlflow": "mlflow",
        "plot_mujoco": "mujoco",
        "plot_onnx_runtime": "onnxruntime",
        "plot_optuna": "optuna",
        "plot_pandas_polars": "polars",
        "plot_skops": "skops",
    }.items()
    if find_spec(package) is None
]
if Path(_recordings).is_dir() and not os.environ.get("SKIDYN_SMALL"):
    os.environ["SKIDYN_DATA"] = str(_recordings)
else:  # in their small size, tests/whole/test_examples.py runs them and looks at their results
    _not_run.append("plot_real_")

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": rf"/(?!{'|'.join(_not_run)})plot_" if _not_run else "/plot_",
    "ignore_pattern": r"__init__\.py|_mock|conftest",
    "within_subsection_order": "FileNameSortKey",
    "remove_config_comments": True,
    "capture_repr": (),  # the address of a Display object says nothing
    "download_all_examples": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "default_thumb_file": str(HERE / "_static" / "logo.png"),
    "parallel": True,  # as many processes as sphinx is given by -j
}


def _forget_own_effects(gallery_conf: dict, file_name: str) -> None:
    """Take effects that an example has registered out of the catalogue before the next one."""
    for kind in set(list_effects()) - _EFFECTS:
        unregister_effect(kind)


def _colours_for_all(gallery_conf: dict, file_name: str) -> None:
    """The colours of Okabe and Ito, which every common form of colour-blindness tells apart."""
    from cycler import cycler
    from matplotlib import rcParams

    okabe_ito = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#17202a"]
    rcParams["axes.prop_cycle"] = cycler(color=okabe_ito)


_EFFECTS = set(list_effects())
sphinx_gallery_conf["reset_modules"] = ("matplotlib", _colours_for_all, _forget_own_effects)
suppress_warnings = ["config.cache"]
