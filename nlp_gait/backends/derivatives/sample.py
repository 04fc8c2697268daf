"""Derivatives of one sample's function, as functions to emit: in directions, or all nonzeros at once where they are few."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from nlp_gait.backends.derivatives.plan import Integers
from nlp_gait.backends.derivatives.structure import nonzeros

# Longest function of which all derivatives are written out, if that is cheaper than one direction after the other.
LONGEST_WRITTEN_OUT = 2000
# Written out they may be so much longer than in a direction: it is compiled once, and saves time in every call.
MOST_GROWTH = 2.0


@dataclass(frozen=True, kw_only=True, eq=False)
class SampleDerivatives:
    """Functions of one sample. Of its inputs u some are active: they depend on the NLP's variables.

    Attributes:
        value: u (m,) to v (nv,).
        jacobian: sparsity (nv, ma) of dv / du.
        hessian: sparsity (ma, ma) of the second derivatives of any sum of outputs, symmetric.
        directional: whether ``first`` and ``second`` take a direction.
        first: (u, du) to dv; or u to the nonzeros of the Jacobian.
        second: (u, weights of the outputs, du) to their gradient and its change; or (u, weights) to the gradient and the
            nonzeros of the Hessian.
    """

    value: ca.Function
    jacobian: ca.Sparsity
    hessian: ca.Sparsity
    directional: bool
    first: ca.Function
    second: ca.Function


def derive_sample(
    function: ca.Function, active: Integers, used: Integers, count: int, directions: int
) -> SampleDerivatives:
    """Derivatives of a function in the form that is cheapest.

    Args:
        function: of one vector, to one vector.
        active: places of the inputs that vary.
        used: places of the outputs that count.
        count: samples.
        directions: that each sample needs at most, besides one for each active input.
    """
    u = function.sx_in(0)
    v = function.call([u])[0][used.tolist()]
    x, weights, du = u[active.tolist()], SX.sym("weights", v.shape[0]), SX.sym("du", len(active))
    gradient = ca.densify(ca.jtimes(v, x, weights, True))
    value = ca.Function("value", [u], [ca.cse(v)])
    # The symbols of u that vary are replaced by nothing: sparsity is asked of the expressions themselves.
    jacobian = ca.jacobian_sparsity(v, x)
    hessian = ca.jacobian_sparsity(gradient, x)
    hessian = hessian + hessian.T
    first = ca.Function("first", [u, du], _shared([ca.densify(ca.jtimes(v, x, du))]))
    second = ca.Function("second", [u, weights, du], _shared([gradient, ca.densify(ca.jtimes(gradient, x, du))]))
    in_directions = first.n_instructions() + second.n_instructions()
    if value.n_instructions() <= LONGEST_WRITTEN_OUT:
        J, H = ca.jacobian(v, x), ca.triu(ca.jacobian(gradient, x))
        all_first = ca.Function("first", [u], _shared([nonzeros(ca.project(J, jacobian))]))
        all_second = ca.Function("second", [u, weights], _shared([gradient, nonzeros(ca.project(H, ca.triu(hessian)))]))
        written_out = all_first.n_instructions() + all_second.n_instructions()
        if written_out <= MOST_GROWTH * in_directions and written_out <= in_directions * min(directions, len(active)):
            return SampleDerivatives(
                value=value, jacobian=jacobian, hessian=hessian, directional=False, first=all_first, second=all_second
            )
    return SampleDerivatives(
        value=value, jacobian=jacobian, hessian=hessian, directional=True, first=first, second=second
    )


def _shared(outputs: list[SX]) -> list[SX]:
    return list(ca.cse(outputs))
