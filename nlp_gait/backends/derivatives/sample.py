"""Derivatives of the function of one sample, as functions to emit: in directions, or all nonzeros where they are few."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
from casadi import SX

from nlp_gait.backends.derivatives.plan import Integers
from nlp_gait.backends.derivatives.structure import nonzeros

# Longest function whose derivatives are all written out, if that is cheaper than one direction after the other.
LONGEST_WRITTEN_OUT = 2000
# Largest ratio of their lengths: the source is compiled once, and written out it saves time in every call.
MOST_GROWTH = 2.0


class SampleDerivatives(NamedTuple):
    """Functions of one sample. Some of its inputs u are active: they depend on the NLP's variables."""

    value: ca.Function  #: u (m,) to v (nv,)
    jacobian: ca.Sparsity  #: sparsity (nv, ma) of dv / du
    hessian: ca.Sparsity  #: sparsity (ma, ma) of the second derivatives of any sum of outputs, symmetric
    directional: bool  #: whether ``first`` and ``second`` take a direction
    first: ca.Function  #: (u, du) to dv; or u to the nonzeros of the Jacobian
    #: (u, weights of the outputs, du) to their gradient and its change; or (u, weights) to the gradient and the nonzeros of
    #: the Hessian
    second: ca.Function


def derive_sample(function: ca.Function, active: Integers, used: Integers, directions: int) -> SampleDerivatives:
    """Return the derivatives of a function in the cheapest form.

    Args:
        function: from one vector to one vector.
        active: places of the inputs that vary.
        used: places of the outputs that are read.
        directions: largest number of directions of a sample, where these are not its active inputs.
    """
    u = function.sx_in(0)
    v = function.call([u])[0][used.tolist()]
    x, weights, du = u[active.tolist()], SX.sym("weights", v.shape[0]), SX.sym("du", len(active))
    gradient = ca.densify(ca.jtimes(v, x, weights, True))
    value = ca.Function("value", [u], [ca.cse(v)])
    jacobian = ca.jacobian_sparsity(v, x)
    hessian = ca.jacobian_sparsity(gradient, x)
    hessian = hessian + hessian.T
    first = ca.Function("first", [u, du], ca.cse([ca.densify(ca.jtimes(v, x, du))]))
    second = ca.Function("second", [u, weights, du], ca.cse([gradient, ca.densify(ca.jtimes(gradient, x, du))]))
    in_directions = first.n_instructions() + second.n_instructions()
    if value.n_instructions() <= LONGEST_WRITTEN_OUT:
        J, H = ca.jacobian(v, x), ca.triu(ca.jacobian(gradient, x))
        all_first = ca.Function("first", [u], ca.cse([nonzeros(ca.project(J, jacobian))]))
        all_second = ca.Function("second", [u, weights], ca.cse([gradient, nonzeros(ca.project(H, ca.triu(hessian)))]))
        written_out = all_first.n_instructions() + all_second.n_instructions()
        if written_out <= MOST_GROWTH * in_directions and written_out <= in_directions * min(directions, len(active)):
            return SampleDerivatives(value, jacobian, hessian, False, all_first, all_second)
    return SampleDerivatives(value, jacobian, hessian, True, first, second)
