"""NLP solvers by name."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.slsqp import Slsqp
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError, check_name, unknown
from nlp_gait.files import convert_errors

SOLVERS: Mapping[str, type[Solver]] = {solver.name: solver for solver in (IpoptSettings, Slsqp)}


def make_solver(name: str, /, **settings: Any) -> Solver:
    """Make an NLP solver by its name, with settings that differ from the defaults; raises UnknownNameError and InputError."""
    names = list_settings(name)
    for setting in settings:
        if setting not in names:
            raise unknown(f"setting of {name}", setting, names)
    with convert_errors(f"setting of {name}", InputError):
        decode(SOLVERS[name], settings)
    return SOLVERS[name](**settings)


def list_settings(name: str) -> tuple[str, ...]:
    """Return the names of a solver's settings; raises UnknownNameError."""
    check_name("solver", name)
    if name not in SOLVERS:
        raise unknown("NLP solver", name, SOLVERS)
    return tuple(field.name for field in fields(SOLVERS[name]))  # type: ignore[arg-type]
