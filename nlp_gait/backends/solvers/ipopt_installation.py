"""Options that every IPOPT gets here, and the linear solver of this installation."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

import casadi as ca

from nlp_gait.errors import InputError
from nlp_gait.files import temporary_folder

# Options of every IPOPT here: it prints nothing, and ignores an ``ipopt.opt`` that happens to lie in the working folder.
QUIET: Mapping[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,  # the status says that a function returned NaN
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.option_file_name": "",
}


# Linear solvers that IPOPT knows; all but the last two load a library that the user must have.
LINEAR_SOLVERS = ("ma27", "ma57", "ma77", "ma86", "ma97", "pardiso", "mumps", "spral")


@cache
def linear_solver(wanted: str | None = None) -> str:
    """Linear solver that IPOPT really uses in this installation, read from its own log.

    Args:
        wanted: one of ``LINEAR_SOLVERS``; None for IPOPT's default.

    Raises:
        InputError: the wanted one does not run here.
        OutputError: there is no room for the log.
    """
    x = ca.MX.sym("x")
    with temporary_folder("nlp-gait-ipopt-") as folder:
        log = folder / "ipopt.log"
        options: dict[str, Any] = {
            **QUIET,
            "ipopt.output_file": str(log),
            "ipopt.file_print_level": 5,
            **({} if wanted is None else {"ipopt.linear_solver": wanted}),
        }
        probe = ca.nlpsol("probe", "ipopt", {"x": x, "f": x**2}, options)
        probe(x0=1.0)
        found = re.search(r"linear solver (\S+?)[,.\s]", log.read_text() if log.exists() else "")
    used = found.group(1) if found else "unknown"
    status = str(probe.stats()["return_status"])
    if wanted is not None and (status != "Solve_Succeeded" or used.lower() != wanted):
        raise InputError(
            f"IPOPT's linear solver {wanted!r} does not run in this installation ({status.replace('_', ' ').lower()}; its "
            f"library may be missing); leave linear_solver out for {linear_solver()}"
        )
    return used
