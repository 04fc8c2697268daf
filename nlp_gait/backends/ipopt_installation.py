"""What every IPOPT is told here, and which linear solver this installation has."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca

# Options of every IPOPT here: silent, and deaf to an ``ipopt.opt`` that happens to lie in the working folder.
QUIET: Mapping[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,  # the status says that a function returned NaN
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.option_file_name": "",
}


@cache
def linear_solver() -> str:
    """Linear solver that IPOPT uses by default in this installation, read from its own log."""
    x = ca.MX.sym("x")
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "ipopt.log"
        options: dict[str, Any] = {
            **QUIET,
            "ipopt.output_file": str(log),
            "ipopt.file_print_level": 5,
        }
        ca.nlpsol("probe", "ipopt", {"x": x, "f": x**2}, options)(x0=1.0)
        found = re.search(r"linear solver (\S+?)[,.\s]", log.read_text() if log.exists() else "")
    return found.group(1) if found else "unknown"
