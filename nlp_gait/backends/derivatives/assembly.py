"""The plan of an NLP's values and derivatives, from its structure: the chain rule over samples and glue.

First derivatives go forward: D = du/dw from the glue, dv/dw = (dv/du) D sample by sample. Second ones go backward: with the
outputs' weights of each sample, H = sum D' (d2v/du2) D, and what the glue adds. Long functions of a sample are evaluated for
each column of D, short ones write out their derivatives, with which D is multiplied.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.derivatives.plan import FIRST, ONE, SECOND, Call, DerivativePlan, Integers, PlaceBlock, Row
from nlp_gait.backends.derivatives.structure import Assembler, Glue, StagePlaces, Structure, stack_nonzeros, unite

# Columns d and c, the entries for c, and places of the entry for d and of a factor.
Products: TypeAlias = "list[tuple[Integers, Integers, Row, int, int]]"


class Hessian:
    """Second derivatives of the Lagrangian: sparsity and place of the upper triangle."""

    def __init__(self, assembler: Assembler, stages: Sequence[StagePlaces], last: Glue, weights: int) -> None:
        self.assembler, self.plan = assembler, assembler.plan
        plan = self.plan
        bars = []
        self.bar_places = np.full(assembler.y.shape[0], -1)
        for samples in stages:
            size = samples.count * len(samples.used)
            bars.append(plan.allocate(size))
            plan.reset(SECOND, bars[-1], size)
            samples.place_outputs(self.bar_places, bars[-1])
        marker = len(plan.steps[SECOND])
        contributions: Products = []
        self._add_glue(last, weights + np.arange(last.rows.shape[0]), contributions)
        for samples, bar in zip(reversed(stages), reversed(bars), strict=True):
            if len(samples.active) and len(samples.used):
                self._add_samples(samples, bar, contributions)
        entries = np.concatenate([np.zeros(0, int), *(d * assembler.n + c for d, c, *_ in contributions)])
        keys, numbers = np.unique(entries, return_inverse=True)
        self.place = plan.allocate(len(keys))
        plan.reset(SECOND, self.place, len(keys), marker)
        end = 0
        for _, c, row, first, second in contributions:
            begin, end = end, end + len(c)
            plan.add_product(SECOND, row, self.place + numbers[begin:end], first, second)
        n = assembler.n
        self.sparsity = ca.Sparsity.triplet(n, n, (keys % n).tolist(), (keys // n).tolist())

    def _add_glue(self, glue: Glue, weights: Integers, contributions: Products) -> None:
        """Add the weights of the outputs that glue reads, and its own second derivatives."""
        assembler, plan = self.assembler, self.plan
        symbols = SX.sym("weights", glue.rows.shape[0])
        for weight, entries in zip(weights.tolist(), glue.entries, strict=True):
            for j, factor in entries:
                if j >= assembler.n:
                    row = Row(np.zeros(1, int), np.array([weight]))
                    plan.add_product(SECOND, row, self.bar_places[[j]], factor, ONE)
        curved = [i for i, entries in enumerate(glue.entries) if any(f not in plan.initial for _, f in entries)]
        if not curved:
            return
        total = ca.dot(symbols[curved], glue.rows[curved])
        H = ca.triu(ca.hessian(total, assembler.y)[0])
        first, second = H.sparsity().get_triplet()
        values = stack_nonzeros(H)
        places = plan.allocate(len(first)) + np.arange(len(first))
        assembler.evaluate(SECOND, values, places, (symbols, weights))
        for i, j, place in zip(first, second, places.tolist(), strict=True):
            rows = assembler.derivatives[i], assembler.derivatives[j]
            for row, second_row in [rows] if i == j else [rows, rows[::-1]]:
                _add_outer(row, second_row, place, contributions)

    def _add_samples(self, samples: StagePlaces, bar: int, contributions: Products) -> None:
        plan, sample, count = self.plan, samples.derivatives, samples.count
        ma, nv = len(samples.active), len(samples.used)
        number = plan.add_function(sample.second)
        weights = PlaceBlock(bar, nv, nv, 1, 0)
        gradient = plan.allocate(count * ma)
        write = PlaceBlock(gradient, ma, ma, 1, 0)
        pattern = np.zeros((ma, ma), bool)
        pattern[tuple(sample.hessian.get_triplet())] = True
        if sample.directional:
            place = plan.allocate(count * ma * samples.width)
            change = PlaceBlock(place, ma * samples.width, ma, samples.width, 1)
            given = (samples.read, weights, samples.directions)
            plan.add_call(SECOND, Call(number, count, samples.direction_counts, given, (write, change)))
        else:
            upper = ca.triu(sample.hessian)
            place = plan.allocate(count * upper.nnz())
            change = PlaceBlock(place, upper.nnz(), upper.nnz(), 1, 0)
            plan.add_call(SECOND, Call(number, count, None, (samples.read, weights), (write, change)))
            entry = np.full((ma, ma), -1)
            i, j = upper.get_triplet()
            entry[i, j] = entry[j, i] = np.arange(upper.nnz())
        for e in range(count):
            for a in range(ma):
                row = samples.rows[e][a]
                if sample.directional:
                    changed = [samples.rows[e][b].columns for b in np.flatnonzero(pattern[a])]
                    columns = unite(changed)
                    places = place + (e * ma + a) * samples.width + np.searchsorted(samples.columns[e], columns)
                    _add_outer(row, Row(columns, places), ONE, contributions)
                    continue
                for b in np.flatnonzero(pattern[a]):
                    factor = int(place + e * upper.nnz() + entry[a, b])
                    _add_outer(row, samples.rows[e][b], factor, contributions)
        places = np.full(len(samples.glue.entries), -1)
        for a, i in enumerate(samples.active):
            places[i + samples.m * np.arange(count)] = gradient + a + ma * np.arange(count)
        rows = [i for i, entries in enumerate(samples.glue.entries) if entries]
        glue = samples.glue._replace(rows=samples.glue.rows[rows], entries=[samples.glue.entries[i] for i in rows])
        self._add_glue(glue, places[rows], contributions)


def _add_outer(row: Row, second_row: Row, factor: int, contributions: Products) -> None:
    """Add the products of each entry d of a row with the entries c <= d of another one, times a factor."""
    ends = np.searchsorted(second_row.columns, row.columns, side="right")
    for column, place, end in zip(row.columns.tolist(), row.places.tolist(), ends.tolist(), strict=True):
        if end:
            low = Row(second_row.columns[:end], second_row.places[:end])
            contributions.append((np.full(end, column), low.columns, low, place, factor))


@dataclass(frozen=True, kw_only=True, eq=False)
class NlpPlan:
    """A plan and the places of its inputs and results."""

    plan: DerivativePlan  #: with steps of three phases
    parameters: int  #: k, their number
    #: Place of the variables (n,); likewise ``p`` (k,), ``rows`` (1 + m,) of cost and g, their ``weights`` in the Lagrangian
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
    """Return the plan of an NLP, with second derivatives or without; raises CompilerError for an operation without C++."""
    assembler = Assembler(structure)
    plan, n = assembler.plan, assembler.n
    stages = []
    before = n
    for stage in structure.stages:
        stages.append(StagePlaces(assembler, stage, before))
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
            targets = gradient + derivative.columns
            if row > 0:
                targets = jacobian + starts[row - 1] + np.searchsorted(pattern, derivative.columns)
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
