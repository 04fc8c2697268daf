"""Solvers and search algorithms side by side, judged by the same exact functions."""

from compare.judge import Evaluation, evaluate

__all__ = ["Evaluation", "evaluate"]
