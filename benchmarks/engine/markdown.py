"""Rows of Markdown tables."""


def cells(*texts: str) -> str:
    """Return a row."""
    return f"| {' | '.join(texts)} |"


def header(*names: str) -> str:
    """Return the names of the columns and the line below."""
    return f"{cells(*names)}\n{cells(*['---'] * len(names))}"
