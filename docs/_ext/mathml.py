"""Equations as MathML, which browsers draw themselves: pages need no script and no network.

Sphinx ships a renderer that loads MathJax from the web and one that calls LaTeX; docutils has the
translation to MathML, and this makes it the third. The font is in `_static/maths.css`.
"""

import re
import xml.etree.ElementTree as ET
from html import unescape
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

logger = getLogger(__name__)
NAMESPACE = "{http://www.w3.org/1998/Math/MathML}"
DOTS = ("˙", "¨")
ENTITY = re.compile("&(?!lt;|gt;|amp;)[A-Za-z]+;")  # of HTML, which XML does not know


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_mathml(node, as_block=False))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math">{_mathml(node, as_block=True)}</div>\n')
    raise nodes.SkipNode


def _mathml(node: nodes.Element, as_block: bool) -> str:
    latex = node.astext().strip()
    try:
        return _mended(str(tex2mathml(latex, as_block=as_block)))
    except Exception as error:  # docutils raises whatever its parser stumbles over
        logger.warning("cannot draw the equation %r: %s", latex, error, location=node)
        return latex


def _mended(mathml: str) -> str:
    """Return an equation with subscripts beside dotted letters, and no room around bars."""
    ET.register_namespace("", NAMESPACE[1:-1])
    tree = ET.fromstring(ENTITY.sub(lambda match: unescape(match[0]), mathml))
    for element in tree.iter(f"{NAMESPACE}munderover"):
        if len(element) == 3 and element[2].text in DOTS:
            letter, subscript, dots = list(element)
            dotted = ET.Element(f"{NAMESPACE}mover")
            dotted.extend([letter, dots])
            element[:] = [dotted, subscript]
            element.tag = f"{NAMESPACE}msub"
    for element in tree.iter(f"{NAMESPACE}mo"):
        if element.text == "|":
            element.attrib |= {"lspace": "0", "rspace": "0"}
    return ET.tostring(tree, encoding="unicode")
