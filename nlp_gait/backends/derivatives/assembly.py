"""The plan of an NLP's values and derivatives, from its structure: the chain rule over samples and glue.

First derivatives go forward: D = du/dw from the glue, dv/dw = (dv/du) D sample by sample. Second ones go backward: with the
outputs' weights of each sample, H = sum D' (d2v/du2) D, and what the glue adds. Where a sample depends on no more variables
than it has inputs, directions are the columns of D; else they are its inputs, and D is multiplied in afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.derivatives.plan import ONE, Block, Call, Integers, Plan, Row
from nlp_gait.backends.derivatives.sample import sample_derivatives
from nlp_gait.backends.derivatives.structure import Stage, Structure, nonzeros, scalars

VALUES, FIRST, SECOND = range(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class NlpPlan:
    """A plan and where its results stand.

    Attributes:
        plan: with steps of three phases.
        parameters: k, their number.
        w: place of the variables (n,); likewise ``p`` (k,), ``rows`` (1 + m,) of cost and g, ``weights`` (1 + m,) of these in
            the Lagrangian.
        gradient: place of the dense gradient (n,).
        jacobian: sparsity (m, n).
        jacobian_places: of its nonzeros, in CasADi's order.
        hessian: sparsity (n, n), upper triangle.
        hessian_place: of its nonzeros, which stand in CasADi's order.
    """

    plan: Plan
    parameters: int
    w: int
    p: int
    rows: int
    weights: int
    gradient: int
    jacobian: ca.Sparsity
    jacobian_places: Integers
    hessian: ca.Sparsity
    hessian_place: int


class _Glue(NamedTuple):
    """Rows of glue and what they mean for derivatives.

    Attributes:
        rows: (r,) expressions.
        places: (r,) of their values.
        entries: for each row the numbers of the y's that it depends on, and places of the derivatives.
    """

    rows: SX
    places: Integers
    entries: list[list[tuple[int, int]]]


def plan_of(structure: Structure, *, second: bool = True) -> NlpPlan:
    """The plan of an NLP.

    Args:
        structure: of the NLP.
        second: whether second derivatives are wanted.

    Raises:
        NotMapped: it uses an operation that has no C++ here.
    """
    return _Assembler(structure).assembled(second)


class _Assembler:
    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self.plan = plan = Plan()
        self.n = n = structure.w.shape[0]
        self.y = ca.vertcat(structure.w, *(stage.outputs for stage in structure.stages))
        self.w, self.p = plan.room(n), plan.room(structure.p.shape[0])
        # Place of the value and derivative of each y; -1 and empty for outputs of samples that are not used.
        self.value_places = np.full(self.y.shape[0], -1)
        self.value_places[:n] = self.w + np.arange(n)
        self.derivatives = [Row(np.array([j]), np.array([ONE])) for j in range(n)]
        self.derivatives += [Row(np.zeros(0, int), np.zeros(0, int))] * (self.y.shape[0] - n)
        self.used = self._used()
        self.samples: list[_Samples] = []

    def assembled(self, second: bool) -> NlpPlan:
        plan, n = self.plan, self.n
        before = n
        for stage in self.structure.stages:
            self.samples.append(_Samples(self, stage, before))
            before += stage.outputs.shape[0]
        rows = self.structure.rows
        place = plan.room(rows.shape[0])
        glue = self.glue(rows, place + np.arange(rows.shape[0]))
        patterns = [self.columns(entries) for entries in glue.entries]
        gradient = plan.room(n)
        starts = np.cumsum([0, *(len(pattern) for pattern in patterns[1:])])
        jacobian = plan.room(int(starts[-1]))
        plan.reset(FIRST, gradient, n + int(starts[-1]))
        for row, (entries, pattern) in enumerate(zip(glue.entries, patterns, strict=True)):
            for j, factor in entries:
                derivative = self.derivatives[j]
                targets = (
                    gradient + derivative.columns
                    if row == 0
                    else jacobian + starts[row - 1] + np.searchsorted(pattern, derivative.columns)
                )
                plan.add(FIRST, derivative, targets, factor)
        m = rows.shape[0] - 1
        number = np.repeat(np.arange(m), np.diff(starts))
        column = np.concatenate([np.zeros(0, int), *patterns[1:]])
        order = np.lexsort((number, column))
        sparsity = ca.Sparsity.triplet(m, n, number.tolist(), column.tolist())
        weights = plan.room(rows.shape[0])
        hessian = _Hessian(self, glue, weights) if second else None
        return NlpPlan(
            plan=plan,
            parameters=self.structure.p.shape[0],
            w=self.w,
            p=self.p,
            rows=place,
            weights=weights,
            gradient=gradient,
            jacobian=sparsity,
            jacobian_places=jacobian + order,
            hessian=hessian.sparsity if hessian else ca.Sparsity(n, n),
            hessian_place=hessian.place if hessian else 0,
        )

    def glue(self, rows: SX, places: Integers) -> _Glue:
        """Rows that are evaluated to places, and their derivatives with respect to y."""
        self.evaluate(VALUES, rows, places)
        J = ca.jacobian(rows, self.y)
        number, column = J.sparsity().get_triplet()
        values = scalars(J)
        factors = np.empty(len(values), int)
        varying = [k for k, value in enumerate(values) if not value.is_constant()]
        for k, value in enumerate(values):
            if value.is_constant():
                factors[k] = self.plan.constant(float(value))
        factors[varying] = self.plan.room(len(varying)) + np.arange(len(varying))
        self.evaluate(FIRST, ca.vertcat(SX(0, 1), *(values[k] for k in varying)), factors[varying])
        entries: list[list[tuple[int, int]]] = [[] for _ in range(rows.shape[0])]
        for i, j, factor in zip(number, column, factors.tolist(), strict=True):
            entries[i].append((j, factor))
        return _Glue(rows, places, entries)

    def evaluate(self, phase: int, outputs: SX, targets: Integers, *more: tuple[SX, Integers]) -> None:
        """Expressions of y, p and more symbols; constants go into the initial values."""
        listed = scalars(ca.densify(outputs))
        varying = [k for k, each in enumerate(listed) if not each.is_constant()]
        for k, each in enumerate(listed):
            if each.is_constant():
                self.plan.initial[int(targets[k])] = float(each)
        p = self.structure.p
        inputs = [self.y, p, *(symbols for symbols, _ in more)]
        places = [self.value_places, self.p + np.arange(p.shape[0]), *(place for _, place in more)]
        self.plan.evaluate(phase, inputs, places, ca.vertcat(SX(0, 1), *(listed[k] for k in varying)), targets[varying])

    def columns(self, entries: list[tuple[int, int]]) -> Integers:
        """Variables that a row of glue depends on, ascending."""
        parts = [self.derivatives[j].columns for j, _ in entries]
        return np.unique(np.concatenate(parts)) if parts else np.zeros(0, int)

    def _used(self) -> Integers:
        """(y,) whether any glue reads it."""
        rows = ca.vertcat(*(stage.inputs for stage in self.structure.stages), self.structure.rows)
        function = ca.Function("all", [self.y, self.structure.p], [rows])
        found = np.zeros(self.y.shape[0], bool)
        for k in range(function.n_instructions()):
            if function.instruction_id(k) == ca.OP_INPUT:
                which, place = function.instruction_input(k)[:2]
                if which == 0:
                    found[place] = True
        return found


class _Samples:
    """A stage: where its inputs and outputs stand, and rows of derivatives of both."""

    def __init__(self, assembler: _Assembler, stage: Stage, before: int) -> None:
        plan, count = assembler.plan, stage.count
        m, all_outputs = stage.function.nnz_in(0), stage.function.nnz_out(0)
        self.count, self.before = count, before
        self.u = plan.room(count * m)
        self.glue = assembler.glue(stage.inputs, self.u + np.arange(count * m))
        active = np.unique([i % m for i, entries in enumerate(self.glue.entries) if entries]).astype(int)
        used = np.flatnonzero(assembler.used[before : before + count * all_outputs].reshape(count, -1).any(axis=0))
        self.active, self.used, self.m = active, used, m
        # Derivatives of active inputs, sample by sample.
        patterns = [[assembler.columns(self.glue.entries[e * m + i]) for i in active] for e in range(count)]
        self.columns = [np.unique(np.concatenate([np.zeros(0, int), *each])) for each in patterns]
        most = max((len(each) for each in self.columns), default=0)
        self.derivatives = sample_derivatives(stage.function, active, used, count, most)
        self.by_column = self.derivatives.directional and most <= len(active)
        self.v = plan.room(count * len(used))
        value = plan.function(self.derivatives.value)
        self.read = Block(self.u, m, m, 1, 0)
        plan.call(VALUES, Call(value, count, None, (self.read,), (Block(self.v, len(used), len(used), 1, 0),)))
        for place, o in enumerate(used):
            numbers = before + o + all_outputs * np.arange(count)
            assembler.value_places[numbers] = self.v + place + len(used) * np.arange(count)
        self.outputs = all_outputs
        self.width = most if self.by_column else len(active)
        self.rows = self._input_rows(assembler, patterns)
        if len(active) and len(used):
            self._output_rows(assembler)

    def directions(self) -> Integers:
        """Of each sample."""
        return (
            np.array([len(each) for each in self.columns]) if self.by_column else np.full(self.count, len(self.active))
        )

    def _input_rows(self, assembler: _Assembler, patterns: list[list[Integers]]) -> list[list[Row]]:
        """Derivatives of active inputs with respect to the variables."""
        plan, ma = assembler.plan, len(self.active)
        rows: list[list[Row]] = []
        if self.by_column:
            self.d = plan.room(self.count * ma * self.width)
            mark, moved = len(plan.steps[FIRST]), False
            for e, each in enumerate(patterns):
                rows.append([])
                for a, pattern in enumerate(each):
                    base = self.d + (e * ma + a) * self.width
                    row = Row(pattern, base + np.searchsorted(self.columns[e], pattern))
                    moved |= _filled(assembler, row, self.glue.entries[e * self.m + self.active[a]])
                    rows[-1].append(row)
            if moved:  # else they are constant from the beginning
                plan.reset(FIRST, self.d, self.count * ma * self.width, mark)
            return rows
        mark, begin = len(plan.steps[FIRST]), plan.size
        for e, each in enumerate(patterns):
            rows.append([])
            for a, pattern in enumerate(each):
                entries = self.glue.entries[e * self.m + self.active[a]]
                if len(entries) == 1 and entries[0][1] == ONE:
                    rows[-1].append(assembler.derivatives[entries[0][0]])
                    continue
                row = Row(pattern, plan.room(len(pattern)) + np.arange(len(pattern)))
                _filled(assembler, row, entries)
                rows[-1].append(row)
        plan.reset(FIRST, begin, plan.size - begin, mark)
        return rows

    def _output_rows(self, assembler: _Assembler) -> None:
        """Call for the first derivatives, and derivatives of the outputs with respect to the variables."""
        plan, found, count = assembler.plan, self.derivatives, self.count
        ma, nv = len(self.active), len(self.used)
        number = plan.function(found.first)
        if found.directional:
            place = plan.room(count * nv * self.width)
            directions = (
                Block(self.d, ma * self.width, ma, self.width, 1)
                if self.by_column
                else Block(unit(plan, ma), 0, ma, ma, 1)
            )
            write = Block(place, nv * self.width, nv, self.width, 1)
            plan.call(FIRST, Call(number, count, self.directions(), (self.read, directions), (write,)))
        else:
            nonzeros = found.jacobian.nnz()
            place = plan.room(count * nonzeros)
            plan.call(FIRST, Call(number, count, None, (self.read,), (Block(place, nonzeros, nonzeros, 1, 0),)))
        at = np.full((nv, ma), -1)
        output, source = found.jacobian.get_triplet()
        at[output, source] = np.arange(len(output))
        mark, begin = len(plan.steps[FIRST]), plan.size
        for e in range(count):
            for o, name in enumerate(self.used):
                inputs = np.flatnonzero(at[o] >= 0)
                rows = [self.rows[e][a] for a in inputs]
                columns = np.unique(np.concatenate([np.zeros(0, int), *(row.columns for row in rows)]))
                y = self.before + e * self.outputs + name
                if self.by_column:
                    base = place + (e * nv + o) * self.width
                    assembler.derivatives[y] = Row(columns, base + np.searchsorted(self.columns[e], columns))
                    continue
                slopes = place + ((e * nv + o) * ma + inputs if found.directional else e * nonzeros + at[o, inputs])
                if all(len(row.places) == 1 and row.places[0] == ONE for row in rows) and len(columns) == len(rows):
                    order = np.argsort([row.columns[0] for row in rows])
                    assembler.derivatives[y] = Row(columns, slopes[order])
                    continue
                row = Row(columns, plan.room(len(columns)) + np.arange(len(columns)))
                for given, slope in zip(rows, slopes, strict=True):
                    plan.add(FIRST, given, row.places[np.searchsorted(columns, given.columns)], int(slope))
                assembler.derivatives[y] = row
        plan.reset(FIRST, begin, plan.size - begin, mark)


def unit(plan: Plan, size: int) -> int:
    """Place of a unit matrix."""
    place = plan.room(size * size)
    plan.initial |= {place + i * (size + 1): 1.0 for i in range(size)}
    return place


def _filled(assembler: _Assembler, row: Row, entries: list[tuple[int, int]]) -> bool:
    """Add up a row of D; True if that is done at run time."""
    moved = False
    for j, factor in entries:
        source = assembler.derivatives[j]
        moved |= assembler.plan.add(FIRST, source, row.places[np.searchsorted(row.columns, source.columns)], factor)
    return moved


class _Hessian:
    """Second derivatives of the Lagrangian: sparsity and place of the upper triangle."""

    def __init__(self, assembler: _Assembler, last: _Glue, weights: int) -> None:
        self.assembler, self.plan = assembler, assembler.plan
        plan = self.plan
        bars = {id(samples): plan.room(samples.count * len(samples.used)) for samples in assembler.samples}
        for samples in assembler.samples:
            plan.reset(SECOND, bars[id(samples)], samples.count * len(samples.used))
        self.bar_places = np.full(assembler.y.shape[0], -1)
        for samples in assembler.samples:
            bar, nv = bars[id(samples)], len(samples.used)
            for place, o in enumerate(samples.used):
                numbers = samples.before + o + samples.outputs * np.arange(samples.count)
                self.bar_places[numbers] = bar + place + nv * np.arange(samples.count)
        marker = len(plan.steps[SECOND])
        contributions: list[tuple[Integers, Integers, Row, int, int]] = []
        self._glue(last, weights + np.arange(last.rows.shape[0]), contributions)
        for samples in reversed(assembler.samples):
            if len(samples.active) and len(samples.used):
                self._samples(samples, bars[id(samples)], contributions)
        keys = np.unique(np.concatenate([np.zeros(0, int), *(d * assembler.n + c for d, c, *_ in contributions)]))
        self.place = plan.room(len(keys))
        plan.reset(SECOND, self.place, len(keys), marker)
        for d, c, row, first, second in contributions:
            plan.add_product(SECOND, row, self.place + np.searchsorted(keys, d * assembler.n + c), first, second)
        self.sparsity = ca.Sparsity.triplet(
            assembler.n, assembler.n, (keys % assembler.n).tolist(), (keys // assembler.n).tolist()
        )

    def _glue(
        self, glue: _Glue, weights: Integers, contributions: list[tuple[Integers, Integers, Row, int, int]]
    ) -> None:
        """Weights of the samples' outputs that glue reads, and its own second derivatives."""
        assembler, plan = self.assembler, self.plan
        symbols = SX.sym("weights", glue.rows.shape[0])
        for weight, entries in zip(weights.tolist(), glue.entries, strict=True):
            for j, factor in entries:
                if j >= assembler.n:
                    plan.add_product(
                        SECOND, Row(np.zeros(1, int), np.array([weight])), self.bar_places[[j]], factor, ONE
                    )
        curved = [i for i, entries in enumerate(glue.entries) if any(f not in plan.initial for _, f in entries)]
        if not curved:
            return
        total = ca.dot(symbols[curved], glue.rows[curved])
        H = ca.triu(ca.hessian(total, assembler.y)[0])
        first, second = H.sparsity().get_triplet()
        values = nonzeros(H)
        places = plan.room(len(first)) + np.arange(len(first))
        assembler.evaluate(SECOND, values, places, (symbols, weights))
        for i, j, place in zip(first, second, places.tolist(), strict=True):
            rows = assembler.derivatives[i], assembler.derivatives[j]
            for row, other in [rows] if i == j else [rows, rows[::-1]]:
                _outer(row, other, place, contributions)

    def _samples(
        self, samples: _Samples, bar: int, contributions: list[tuple[Integers, Integers, Row, int, int]]
    ) -> None:
        plan, found, count = self.plan, samples.derivatives, samples.count
        ma, nv = len(samples.active), len(samples.used)
        number = plan.function(found.second)
        weights = Block(bar, nv, nv, 1, 0)
        gradient = plan.room(count * ma)
        write = Block(gradient, ma, ma, 1, 0)
        pattern = np.zeros((ma, ma), bool)
        pattern[tuple(found.hessian.get_triplet())] = True
        if found.directional:
            place = plan.room(count * ma * samples.width)
            directions = (
                Block(samples.d, ma * samples.width, ma, samples.width, 1)
                if samples.by_column
                else Block(unit(plan, ma), 0, ma, ma, 1)
            )
            change = Block(place, ma * samples.width, ma, samples.width, 1)
            given = (samples.read, weights, directions)
            plan.call(SECOND, Call(number, count, samples.directions(), given, (write, change)))
        else:
            upper = ca.triu(found.hessian)
            place = plan.room(count * upper.nnz())
            change = Block(place, upper.nnz(), upper.nnz(), 1, 0)
            plan.call(SECOND, Call(number, count, None, (samples.read, weights), (write, change)))
            at = np.full((ma, ma), -1)
            i, j = upper.get_triplet()
            at[i, j] = at[j, i] = np.arange(upper.nnz())
        for e in range(count):
            for a in range(ma):
                row = samples.rows[e][a]
                if samples.by_column:
                    parts = [samples.rows[e][b].columns for b in np.flatnonzero(pattern[a])]
                    columns = np.unique(np.concatenate([np.zeros(0, int), *parts]))
                    base = place + (e * ma + a) * samples.width
                    _outer(row, Row(columns, base + np.searchsorted(samples.columns[e], columns)), ONE, contributions)
                    continue
                for b in np.flatnonzero(pattern[a]):
                    factor = place + ((e * ma + a) * ma + b if found.directional else e * upper.nnz() + at[a, b])
                    _outer(row, samples.rows[e][b], int(factor), contributions)
        places = np.full(len(samples.glue.entries), -1)
        for a, i in enumerate(samples.active):
            places[i + samples.m * np.arange(count)] = gradient + a + ma * np.arange(count)
        rows = [i for i, entries in enumerate(samples.glue.entries) if entries]
        glue = samples.glue._replace(rows=samples.glue.rows[rows], entries=[samples.glue.entries[i] for i in rows])
        self._glue(glue, places[rows], contributions)


def _outer(row: Row, other: Row, factor: int, contributions: list[tuple[Integers, Integers, Row, int, int]]) -> None:
    """Products of each entry d of a row with the entries c <= d of another, times a factor."""
    for column, place in zip(row.columns.tolist(), row.places.tolist(), strict=True):
        end = int(np.searchsorted(other.columns, column, side="right"))
        if end:
            part = Row(other.columns[:end], other.places[:end])
            contributions.append((np.full(end, column), part.columns, part, place, factor))
