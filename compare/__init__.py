"""Solvers and search algorithms side by side, judged by the same exact functions."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.judge import Evaluation, evaluate

__all__ = ["Evaluation", "evaluate"]


def __getattr__(name: str) -> Any:
    """Imported when first used, so that the command line begins at once."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from compare import judge

    return getattr(judge, name)
