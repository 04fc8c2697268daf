"""Display of results in notebooks: small HTML tables, and pandas for data frames."""

from collections.abc import Iterable, Sequence
from html import escape
from types import ModuleType

from nlp_gait.errors import MissingExtraError


def format_html_table(title: str, header: Sequence[str], rows: Iterable[Sequence[str]], note: str = "") -> str:
    """Return a table without own style, so that it follows the notebook's, dark or light; all text is escaped."""
    heads = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    below = f"<p>{escape(note)}</p>" if note else ""
    return (
        f'<div style="overflow-x: auto"><p><b>{escape(title)}</b></p>'
        f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>{below}</div>"
    )


def import_pandas() -> ModuleType:
    """Return the module pandas, which only ``to_frame`` needs; raises MissingExtraError if it is not installed."""
    try:
        import pandas as module
    except ImportError as error:
        raise MissingExtraError(f"a data frame needs pandas ({error}); install it with pip install pandas") from error
    return module
