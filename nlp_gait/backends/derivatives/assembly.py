"""The plan of an NLP's values and derivatives, from its structure: the chain rule over samples and glue.

First derivatives go forward: D = du/dw from the glue, dv/dw = (dv/du) D sample by sample. Second ones go backward: with the
outputs' weights of each sample, H = sum D' (d2v/du2) D, and what the glue adds. Where a sample depends on no more variables
than it has inputs, directions are the columns of D; else they are its inputs, and D is multiplied in afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlp_gait.backends.derivatives.first_order import Samples
from nlp_gait.backends.derivatives.glue import Assembler
from nlp_gait.backends.derivatives.plan import FIRST, Integers, Plan
from nlp_gait.backends.derivatives.second_order import Hessian
from nlp_gait.backends.derivatives.structure import Structure


@dataclass(frozen=True, kw_only=True, eq=False)
class NlpPlan:
    """A plan and the places of its inputs and results."""

    plan: Plan  #: with steps of three phases
    parameters: int  #: k, their number
    #: Place of the variables (n,); likewise ``p`` (k,), ``rows`` (1 + m,) of cost and g, ``weights`` (1 + m,) of these in the
    #: Lagrangian
    w: int
    p: int
    rows: int
    weights: int
    gradient: int  #: place of the dense gradient (n,)
    jacobian: ca.Sparsity  #: sparsity (m, n)
    jacobian_places: Integers  #: of its nonzeros, in CasADi's order
    hessian: ca.Sparsity  #: sparsity (n, n), upper triangle
    hessian_place: int  #: of its nonzeros, in CasADi's order


def make_nlp_plan(structure: Structure, *, second: bool = True) -> NlpPlan:
    """Return the plan of an NLP, with second derivatives or without; raises NotMapped for an operation without C++."""
    assembler = Assembler(structure)
    plan, n = assembler.plan, assembler.n
    stages = []
    before = n
    for stage in structure.stages:
        stages.append(Samples(assembler, stage, before))
        before += stage.outputs.shape[0]
    rows = structure.rows
    place = plan.allocate(rows.shape[0])
    glue = assembler.add_glue(rows, place + np.arange(rows.shape[0]))
    patterns = [assembler.columns(entries) for entries in glue.entries]
    gradient = plan.allocate(n)
    starts = np.cumsum([0, *(len(pattern) for pattern in patterns[1:])])
    jacobian = plan.allocate(int(starts[-1]))
    plan.reset(FIRST, gradient, n + int(starts[-1]))
    for row, (entries, pattern) in enumerate(zip(glue.entries, patterns, strict=True)):
        for j, factor in entries:
            derivative = assembler.derivatives[j]
            targets = (
                gradient + derivative.columns
                if row == 0
                else jacobian + starts[row - 1] + np.searchsorted(pattern, derivative.columns)
            )
            plan.add_row(FIRST, derivative, targets, factor)
    m = rows.shape[0] - 1
    number = np.repeat(np.arange(m), np.diff(starts))
    column = np.concatenate([np.zeros(0, int), *patterns[1:]])
    order = np.lexsort((number, column))
    sparsity = ca.Sparsity.triplet(m, n, number.tolist(), column.tolist())
    weights = plan.allocate(rows.shape[0])
    hessian = Hessian(assembler, stages, glue, weights) if second else None
    return NlpPlan(
        plan=plan,
        parameters=structure.p.shape[0],
        w=assembler.w,
        p=assembler.p,
        rows=place,
        weights=weights,
        gradient=gradient,
        jacobian=sparsity,
        jacobian_places=jacobian + order,
        hessian=hessian.sparsity if hessian else ca.Sparsity(n, n),
        hessian_place=hessian.place if hessian else 0,
    )
