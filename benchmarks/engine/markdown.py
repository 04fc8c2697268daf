"""Rows of Markdown tables."""


def cells(*texts: str) -> str:
    """One row."""
    return f"| {' | '.join(texts)} |"


def header(*names: str) -> str:
    """Names of the columns and the line below them."""
    return f"{cells(*names)}\n{cells(*['---'] * len(names))}"
