"""Tests without a compiler, where compiling takes longer than the few calls of a kernel when it is interpreted."""

from __future__ import annotations

import pytest


def hide_compilers(patch: pytest.MonkeyPatch) -> None:
    """Let no compiler be found; Zig's is a package, not a program of the path."""
    patch.setenv("CXX", "")
    patch.setenv("CC", "")
    patch.setenv("PATH", "no-programs")
    patch.setattr("nlp_gait.backends.kernel.compiler.find_spec", lambda package: None)
