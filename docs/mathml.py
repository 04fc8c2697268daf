"""Formulas as MathML, which browsers show without scripts and without network; a label is the number of its equation.

A display formula with the label ``B.3`` is numbered (B.3) on its page and wherever ``{eq}`` refers to it.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert


def visit_inline(translator: Any, node: Any) -> None:
    """Write an inline formula."""
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def visit_display(translator: Any, node: Any) -> None:
    """Write a display formula with its number at the right."""
    label = node.get("label")
    translator.body.append(translator.starttag(node, "div", CLASS="math"))
    if label:
        translator.body.append(f'<span class="eqno">({label})</span>')
    translator.body.append(convert(node.astext(), display="block") + "</div>")
    raise nodes.SkipNode


def number_by_label(app: Any, env: Any) -> None:
    """Let references show the label of an equation in place of its position on the page."""
    equations = env.domains["math"].equations
    for label, (page, _) in list(equations.items()):
        equations[label] = (page, label)


def setup(app: Any) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", inline_renderers=(visit_inline, None), block_renderers=(visit_display, None))
    app.connect("env-updated", number_by_label)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
