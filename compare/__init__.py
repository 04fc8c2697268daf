"""Solvers and search algorithms side by side, judged by the same exact functions."""

from __future__ import annotations

# In place of typing's, whose import takes longer than all that Ctrl-C waits for; type checkers know the name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from compare.judge import Evaluation, evaluate

__all__ = ["Evaluation", "evaluate"]


def __getattr__(name: str) -> Any:
    """Imported when first used, so that the command line begins at once."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from compare import judge

    return getattr(judge, name)
