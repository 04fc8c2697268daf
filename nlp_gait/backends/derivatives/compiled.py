"""An NLP whose functions and derivatives are native code, for any solver of CasADi's ``nlpsol``."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.backends.derivatives.assembly import make_nlp_plan
from nlp_gait.backends.derivatives.source import write_casadi_source
from nlp_gait.backends.derivatives.structure import split_nlp
from nlp_gait.backends.kernel.compiler import find_compiler, lane_flags, native_lanes
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.errors import CompilerError
from nlp_gait.formulation import Array

# -O1: more optimisation takes the compiler half as long again and gains nothing that can be measured.
FLAGS = ("-std=c++17", "-O1", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")
VALUES, DERIVATIVES = ("nlp_f", "nlp_g"), {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
# For IPOPT with functions of our own: it shall ask for no other ones, such as derivatives by the parameters.
NO_OTHERS: Mapping[str, bool] = {"no_nlp_grad": True, "calc_lam_p": False}
# Detects a wrong library, not rounding: derivatives are compared with differences over this step.
STEP, CHECK_TOLERANCE, CHECK_POINTS = 1e-6, 1e-3, 5
# Near a singular pose differences are all rounding: there they change with the step, and another point is drawn.
OTHER_STEP, MOST_POINTS = 1e-5, 50


class CompiledNlp:
    """Functions of an NLP in a library, built once and kept in the cache folder.

    Attributes:
        functions: by the names that ``nlpsol`` gives them.
        nlp: CasADi's dictionary of x, p, f, g.
        options: of a new ``nlpsol``, with which it takes the derivatives over; sensitivities to p are not available then.
    """

    def __init__(self, nlp: Mapping[str, MX], p: Array, *, second: bool = True) -> None:
        """Build the library, or load it from the cache.

        Args:
            nlp: CasADi's dictionary of x, p, f, g.
            p: (k,) parameter values at which the library is checked against the virtual machine.
            second: with second derivatives.

        Raises:
            CompilerError: there is no compiler, it fails, or the NLP holds what cannot be taken apart.
        """
        known, compiler, flags = _stands_for(nlp, second), find_compiler(), _flags()
        names = [*VALUES, *list(DERIVATIVES.values())[: 3 if second else 2]]

        def source() -> str:
            return write_casadi_source(make_nlp_plan(split_nlp(nlp), second=second))

        _, library = load_library(known, compiler, flags, names, source)
        self.functions = {name: ca.external(name, str(library)) for name in names}
        self._check(nlp, p, str(library))
        x, symbols = nlp["x"], nlp["p"]
        self.nlp = {"x": x, "p": symbols, **{key: self.functions[f"nlp_{key}"](x, symbols) for key in ("f", "g")}}
        derivatives = {key: self.functions[name] for key, name in DERIVATIVES.items() if name in self.functions}
        self.options: dict[str, Any] = {**NO_OTHERS, **derivatives}

    def _check(self, nlp: Mapping[str, MX], p: Array, library: str) -> None:
        """Compare values with the virtual machine's, and derivatives with differences, at some points: most must agree.

        Raises:
            CompilerError: they differ: the compiler is broken, or is not for this machine.
        """
        machine = ca.Function("machine", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]])
        rng = np.random.default_rng(0)
        n, m = nlp["x"].shape[0], nlp["g"].shape[0]
        alike = checked = 0
        for _ in range(MOST_POINTS):
            w, d, weights = rng.uniform(0.0, 1.0, n), rng.uniform(-1.0, 1.0, n), rng.uniform(-1.0, 1.0, m)
            slope, other = (
                (_numbers(machine(w + step * d, p)) - _numbers(machine(w - step * d, p))) / (2 * step)
                for step in (STEP, OTHER_STEP)
            )
            if not _alike(slope, other):
                continue
            sides = [(w + step * d, p) for step in (STEP, -STEP)]
            values, found = (
                _numbers(machine(w, p)),
                [self.functions[name](w, p) for name in DERIVATIVES.values() if name != "nlp_hess_l"],
            )
            pairs = [(values, _numbers([found[0][0], found[1][0]]))]
            pairs.append((slope, _numbers([ca.dot(found[0][1], d), found[1][1] @ d])))
            if "nlp_hess_l" in self.functions:
                curved = [self._gradient(*side, weights) for side in sides]
                H = self.functions["nlp_hess_l"](w, p, 1.0, weights)
                pairs.append(((curved[0] - curved[1]) / (2 * STEP), _numbers([ca.triu2symm(H) @ d])))
            alike += all(_alike(expected, value) for expected, value in pairs)
            if (checked := checked + 1) == CHECK_POINTS:
                break
        if 2 * alike <= checked:
            raise CompilerError(
                f"{library} computes other values than the virtual machine; delete it, and try another compiler (CXX)"
            )

    def _gradient(self, w: Array, p: Array, weights: Array) -> Array:
        """Of the Lagrangian."""
        (_, slope), (_, J) = (self.functions[name](w, p) for name in ("nlp_grad_f", "nlp_jac_g"))
        return _numbers([slope + J.T @ weights])


def _stands_for(nlp: Mapping[str, MX], second: bool) -> str:
    """What a library's source depends on: it need not be generated to find the library."""
    graph = ca.Function("nlp", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]]).serialize()
    return "\0".join([graph, version("casadi"), _generator(), str(second)])


@cache
def _generator() -> str:
    """Hash of the code that writes the source."""
    digest = hashlib.sha256(files("nlp_gait.symbolic").joinpath("tape.py").read_bytes())
    backends = files("nlp_gait.backends")
    for folder in ("derivatives", "derivatives/native", "kernel/native"):
        for file in sorted(backends.joinpath(folder).iterdir(), key=lambda each: each.name):
            if file.name.endswith((".py", ".hpp")):
                digest.update(file.read_bytes())
    return digest.hexdigest()


def _flags() -> tuple[str, ...]:
    lanes = native_lanes()
    return (*FLAGS, *lane_flags(lanes), f"-DLANES={lanes}")


def _numbers(parts: Any) -> Array:
    return np.concatenate([ca.DM(part).full().ravel() for part in parts])


def _alike(expected: Array, found: Array) -> bool:
    """Within the tolerance, relative to the largest; not a number where the virtual machine has none."""
    scale = np.abs(expected[np.isfinite(expected)]).max(initial=1e-6)
    return bool(np.allclose(found, expected, rtol=0.0, atol=CHECK_TOLERANCE * scale, equal_nan=True))
