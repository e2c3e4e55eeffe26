"""Sphinx extension: equations become MathML when the site is built.

Browsers draw MathML themselves, so that pages need no scripts. The converter is that of docutils;
what it does not know is a warning, as anything else that goes wrong. The font, STIX Two Math under
the SIL Open Font License, comes with ziamath and is copied into the site: few systems have one.
"""

import re
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

LOGGER = logging.getLogger(__name__)
# An index of an accented letter belongs beside it, not below.
ACCENT = re.compile(r"(\\(?:dd?ot|bar|tilde|hat)\s*(?:[a-zA-Z]|\{[^{}]*\}))(?=\s*[_^])")
# The converter knows sizes of opening and closing delimiters only.
SIZE = re.compile(r"\\([bB]igg?)(?=\s*([][()|]))")


def mathml(node: nodes.Node, block: bool) -> str:
    """MathML of an equation."""
    text = ACCENT.sub(r"\1{}", node.astext().strip())
    try:
        return tex2mathml(SIZE.sub(
            lambda found: rf"\{found[1]}{'r' if found[2] in ')]' else 'l'}", text), as_block=block)
    except MathError as problem:
        LOGGER.warning("equation %r: %s", text, problem, location=node)
        return ""


def inline(writer: Any, node: nodes.math) -> None:
    """Write an equation within a line."""
    writer.body.append(mathml(node, block=False))
    raise nodes.SkipNode


def displayed(writer: Any, node: nodes.math_block) -> None:
    """Write an equation of its own, with its number if it has one."""
    writer.body.append(writer.starttag(node, "div", CLASS="equation"))
    if node["number"]:
        number = get_node_equation_number(writer, node)
        writer.body.append(f'<span class="eqno">({number})</span>')
    writer.body.append(mathml(node, block=True))
    writer.body.append("</div>")
    raise nodes.SkipNode


def copy_font(app: Any) -> None:
    """Put the font where the stylesheet looks for it, compressed."""
    from fontTools.ttLib import TTFont

    target = Path(app.srcdir) / "_static" / "STIXTwoMath.woff"
    if not target.exists():
        with as_file(files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf") as path:
            font = TTFont(path)
            font.flavor = "woff"
            font.save(target)


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", copy_font)
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
