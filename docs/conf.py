"""Configuration of Sphinx; the documentation is built and read without a network."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

sys.path.insert(0, str(Path(__file__).parent))

from generate import write_all

from rockframe import __version__

project = "rockframe"
author = "The rockframe developers"
copyright = "The rockframe developers, MIT licence"  # noqa: A001 -- Sphinx's name for it
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["generated/*.txt"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # by default loaded from the network

autodoc_typehints = "none"  # the docstrings state types, shapes and units
autodoc_preserve_defaults = True  # as written, not as evaluated on this machine
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
default_role = "py:obj"

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_js_files = ["pages.js"]
html_title = f"rockframe {version}"
html_copy_source = False
html_show_sourcelink = False
html_math_renderer = "mathml"


def literal_bars(
    _app: Any, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]
) -> None:
    """Keep ``|theta|`` an absolute value, and a ``*`` before a comma a wildcard.

    reStructuredText would read them as a substitution and as emphasis.
    """
    for i, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            lines[i] = re.sub(r"(?<=\w )\*(?=,)", r"\*", line.replace("|", r"\|"))


#: MathML that docutils writes for an index of an accented letter, which would be below the letter.
_INDEX_BELOW = re.compile(
    r"<munderover>\s*(<mi>\w+</mi>)\s*(<mi>\w+</mi>)\s*(<mo[^>]*>[^<]*</mo>)\s*</munderover>"
)
_FUNCTION = re.compile(
    r"(</m(?:i|n|sup|frac)>\s*)?((?:<msup>\s*)?<mi[^>]*>(?:sin|cos|tan|sgn)</mi>"
    r"(?:\s*<mn>\d</mn>\s*</msup>)?)(?!\s*<mo>&ApplyFunction;</mo>\s*<mo[^>]*>\()"
)
#: Bars and slashes, which browsers would stretch and surround with space, like an equals sign.
_TIGHT = re.compile(r"<mo[^>]*>([|/])</mo>")
_SPACE = '<mspace width="0.17em"/>'


def mathml(tex: str, *, as_block: bool = False) -> str:
    """Return MathML in which an index follows its letter, and a function has space around it."""
    text = tex2mathml(tex, as_block=as_block)
    text = _INDEX_BELOW.sub(r"<msub><mover accent='true'>\1\3</mover>\2</msub>", text)
    if "munderover" in text or re.search(r"frac\d", tex):
        raise ValueError(f"docutils sets {tex!r} as something else")
    text = _TIGHT.sub(r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>', text)
    return _FUNCTION.sub(lambda m: f"{m[1] + _SPACE if m[1] else ''}{m[2]}{_SPACE}", text)


def _mathml(translator: Any, node: nodes.Node, *, as_block: bool) -> None:
    translator.body.append(mathml(node.astext(), as_block=as_block))
    raise nodes.SkipNode


def inline_math(translator: Any, node: nodes.Node) -> None:
    """Write inline MathML, which browsers draw themselves."""
    _mathml(translator, node, as_block=False)


def display_math(translator: Any, node: nodes.Node) -> None:
    """Write MathML on a separate line."""
    _mathml(translator, node, as_block=True)


def setup(app: Any) -> dict[str, Any]:
    """Generate pages from the package, and register the writers of MathML."""
    write_all(Path(app.srcdir) / "generated")
    app.add_html_math_renderer("mathml", (inline_math, None), (display_math, None))
    app.connect("autodoc-process-docstring", literal_bars, priority=100)
    return {"parallel_read_safe": True}
