"""Equations as MathML, which browsers draw themselves: pages need no script and no network.

Sphinx ships a renderer that loads MathJax from the web and one that calls LaTeX; docutils has the
translation to MathML, and this makes it the third.
"""

from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

logger = getLogger(__name__)


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
    if as_block and r"\\" in latex and not latex.startswith(r"\begin"):
        latex = rf"\begin{{aligned}}{latex}\end{{aligned}}"
    try:
        return str(tex2mathml(latex, as_block=as_block))
    except Exception as error:  # docutils raises whatever its parser stumbles over
        logger.warning("cannot draw the equation %r: %s", latex, error, location=node)
        return latex
