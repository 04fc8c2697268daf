"""An NLP split into the functions that it calls, mapped over samples or once, and the cheap expressions between them (the glue).

y = (w, v_1, ..., v_K),  u_k = glue_k(w, p, v_1, ..., v_{k-1}),  v_k = function_k(u_k) sample by sample,  (f, g) = glue(w, p, v).

First derivatives of u come from the glue, those of v from the chain rule.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple, cast

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.backends.derivatives.plan import (
    FIRST,
    ONE,
    VALUES,
    Call,
    DerivativePlan,
    Integers,
    PlaceBlock,
    Row,
)
from nlp_gait.errors import CompilerError
from nlp_gait.symbolic.tape import read_tape

CALLED = ("Map", "SXFunction")  # CasADi's classes of functions that become stages


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """A function of one sample that is called at all samples; one that is not mapped has one sample."""

    function: ca.Function  #: of one sample, from all inputs (m,) to all outputs (nv,)
    count: int
    inputs: SX  #: (count * m,) glue, sample by sample
    outputs: SX  #: (count * nv,) symbols in place of the outputs, sample by sample


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """Stages of an NLP in the order in which they are evaluated, and the glue after the last one."""

    w: SX  #: (n,) symbols of the NLP's variables
    p: SX  #: (k,) symbols of its parameters
    stages: tuple[Stage, ...]  #: each depends on earlier ones only
    rows: SX  #: (1 + m,) cost and rows


def split_nlp(nlp: Mapping[str, MX]) -> Structure:
    """Split an NLP, CasADi's dictionary of x, p, f, g; raises CompilerError for other calls than of ``CALLED``."""
    x, p = nlp["x"], nlp["p"]
    whole = ca.Function("nlp", [x, p], [nlp["f"], nlp["g"]])
    numbers = [k for k in range(whole.n_instructions()) if whole.instruction_id(k) == ca.OP_CALL]
    calls = [call for call in map(whole.instruction_MX, numbers) if call.which_function().class_name() in CALLED]
    call_outputs = [[call.get_output(i) for i in range(call.n_out())] for call in calls]
    symbols = [[MX.sym("v", output.sparsity()) for output in outputs] for outputs in call_outputs]
    given = [[call.dep(i) for i in range(call.n_dep())] for call in calls]
    outputs = [nlp["f"], nlp["g"], *chain(*given)]
    replaced = ca.graph_substitute(outputs, [*chain(*call_outputs)], [*chain(*symbols)]) if calls else outputs
    glue = _expand(ca.Function("glue", [x, p, *chain(*symbols)], replaced))
    w, q, *v = glue.sx_in()
    cost, rows, *u = glue.call([w, q, *v])
    stages = []
    for call, inputs, outputs in zip(calls, given, call_outputs, strict=True):
        function = call.which_function()
        inner = _expand(function.find_functions(0)[0] if function.class_name() == "Map" else function)
        arguments = inner.sx_in()  # all nonzeros become one vector
        ends = [ca.vertcat(*map(stack_nonzeros, values)) for values in (arguments, inner.call(arguments))]
        inner = ca.Function(inner.name(), ends[:1], ends[1:])
        count = function.nnz_in() // inner.nnz_in()
        read = _by_sample([u.pop(0) for _ in inputs], count)
        written = _by_sample([v.pop(0) for _ in outputs], count)
        stages.append(Stage(function=inner, count=count, inputs=read, outputs=written))
    return Structure(w=w, p=q, stages=tuple(stages), rows=ca.vertcat(ca.densify(cost), ca.densify(rows)))


def stack_nonzeros(value: SX) -> SX:
    """Return the structural nonzeros as a dense vector."""
    column = SX(value.nz[:])  # a row where the value is one
    return column if column.shape[1] == 1 else column.T


def split_nonzeros(value: SX) -> list[SX]:
    """Return the structural nonzeros one by one."""
    return cast(list[SX], value.nonzeros())


def _expand(function: ca.Function) -> ca.Function:
    try:
        return function.expand()
    except RuntimeError as error:
        raise CompilerError(str(error).splitlines()[-1]) from error


def _by_sample(matrices: list[SX], count: int) -> SX:
    """Return the nonzeros of matrices, a block of columns for each sample, as one vector, sample by sample."""
    columns = [stack_nonzeros(matrix) for matrix in matrices]
    starts = np.cumsum([0, *(column.shape[0] for column in columns)])
    order = [np.arange(*ends).reshape(count, -1) for ends in zip(starts[:-1], starts[1:], strict=True)]
    return ca.vertcat(*columns)[np.hstack(order).ravel().tolist()]


# Longest function whose derivatives are all written out, if that is cheaper than one direction after the other.
LONGEST_WRITTEN_OUT = 2000
# Largest ratio of their lengths: the source is compiled once, and written out it saves time in every call.
MOST_GROWTH = 2.0


class Glue(NamedTuple):
    """Rows of glue and their derivatives."""

    rows: SX  #: (r,) expressions
    places: Integers  #: (r,) places of their values
    #: For each row the numbers of the entries of y that it depends on, and places of the derivatives
    entries: list[list[tuple[int, int]]]


class Assembler:
    """A plan that is being built: y, the variables and the outputs of samples, with places of values and derivatives."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self.plan = plan = DerivativePlan()
        self.n = n = structure.w.shape[0]
        self.y = ca.vertcat(structure.w, *(stage.outputs for stage in structure.stages))
        self.w, self.p = plan.allocate(n), plan.allocate(structure.p.shape[0])
        # Places of the value and derivative of each entry of y; -1 and empty for outputs of samples that are not used.
        self.value_places = np.full(self.y.shape[0], -1)
        self.value_places[:n] = self.w + np.arange(n)
        self.derivatives = [Row(np.array([j]), np.array([ONE])) for j in range(n)]
        self.derivatives += [Row(np.zeros(0, int), np.zeros(0, int))] * (self.y.shape[0] - n)
        self.used = np.zeros(self.y.shape[0] + structure.p.shape[0], bool)  # whether glue reads each entry of y and p
        rows = ca.vertcat(*(stage.inputs for stage in structure.stages), structure.rows)
        for instruction in read_tape(ca.Function("all", [self.y, structure.p], [rows])):
            if instruction.operation == ca.OP_INPUT:
                self.used[instruction.place] = True

    def add_glue(self, rows: SX, places: Integers) -> Glue:
        """Add rows, evaluated to places, and their derivatives with respect to y."""
        self.evaluate(VALUES, rows, places)
        J = ca.jacobian(rows, self.y)
        values = split_nonzeros(J)
        varying = [k for k, value in enumerate(values) if not value.is_constant()]
        factors = np.array([self.plan.place_constant(float(v)) if v.is_constant() else -1 for v in values], int)
        factors[varying] = self.plan.allocate(len(varying)) + np.arange(len(varying))
        self.evaluate(FIRST, ca.vertcat(SX(0, 1), *(values[k] for k in varying)), factors[varying])
        entries: list[list[tuple[int, int]]] = [[] for _ in range(rows.shape[0])]
        for i, j, factor in zip(*J.sparsity().get_triplet(), factors.tolist(), strict=True):
            entries[i].append((j, factor))
        return Glue(rows, places, entries)

    def evaluate(self, phase: int, outputs: SX, targets: Integers, *symbols_and_places: tuple[SX, Integers]) -> None:
        """Add expressions of y, p and more symbols; constants go into the initial values."""
        listed = split_nonzeros(ca.densify(outputs))
        varying = [k for k, value in enumerate(listed) if not value.is_constant()]
        constants = {int(targets[k]): float(value) for k, value in enumerate(listed) if value.is_constant()}
        self.plan.initial.update(constants)
        p = self.structure.p
        inputs = [self.y, p, *(symbols for symbols, _ in symbols_and_places)]
        places = [self.value_places, self.p + np.arange(p.shape[0]), *(place for _, place in symbols_and_places)]
        expressions = ca.vertcat(SX(0, 1), *(listed[k] for k in varying))
        self.plan.add_expressions(phase, inputs, places, expressions, targets[varying])

    def columns(self, entries: list[tuple[int, int]]) -> Integers:
        """Return the variables that a row of glue depends on, ascending."""
        return unite(self.derivatives[j].columns for j, _ in entries)


def unite(columns: Iterable[Integers]) -> Integers:
    """Return all numbers of some arrays, ascending."""
    return np.unique(np.concatenate([np.zeros(0, int), *columns]))


class SampleDerivatives(NamedTuple):
    """Functions of one sample. Some of its inputs u are active: they depend on the NLP's variables."""

    value: ca.Function  #: u (m,) to v (nv,)
    jacobian: ca.Sparsity  #: sparsity (nv, ma) of dv / du
    hessian: ca.Sparsity  #: sparsity (ma, ma) of the second derivatives of any sum of outputs, symmetric
    directional: bool  #: whether ``first`` and ``second`` take a direction: a column of the derivatives of the inputs
    first: ca.Function  #: (u, du) to dv; or u to the nonzeros of the Jacobian
    #: (u, weights of the outputs, du) to their gradient and its change; or (u, weights) to that and the Hessian's nonzeros
    second: ca.Function


def derive_sample(function: ca.Function, active: Integers, used: Integers, directions: int) -> SampleDerivatives:
    """Return the derivatives of a function of vectors in the cheapest form.

    ``active`` inputs vary, ``used`` outputs are read; a sample is differentiated in at most ``directions`` directions, or one for
    each active input.
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
        all_first = ca.Function("first", [u], ca.cse([stack_nonzeros(ca.project(J, jacobian))]))
        all_second = ca.Function(
            "second", [u, weights], ca.cse([gradient, stack_nonzeros(ca.project(H, ca.triu(hessian)))])
        )
        written_out = all_first.n_instructions() + all_second.n_instructions()
        if written_out <= MOST_GROWTH * in_directions and written_out <= in_directions * min(directions, len(active)):
            return SampleDerivatives(value, jacobian, hessian, False, all_first, all_second)
    return SampleDerivatives(value, jacobian, hessian, True, first, second)


class StagePlaces:
    """A stage with the places of its inputs and outputs, and rows of derivatives of both."""

    def __init__(self, assembler: Assembler, stage: Stage, before: int) -> None:
        plan, count = assembler.plan, stage.count
        m, all_outputs = stage.function.nnz_in(0), stage.function.nnz_out(0)
        self.count, self.before = count, before
        self.u = plan.allocate(count * m)
        self.glue = assembler.add_glue(stage.inputs, self.u + np.arange(count * m))
        active = np.unique([i % m for i, entries in enumerate(self.glue.entries) if entries]).astype(int)
        used = np.flatnonzero(assembler.used[before : before + count * all_outputs].reshape(count, -1).any(axis=0))
        self.active, self.used, self.m = active, used, m
        # Derivatives of active inputs, sample by sample.
        patterns = [[assembler.columns(self.glue.entries[e * m + i]) for i in active] for e in range(count)]
        self.columns = [unite(columns) for columns in patterns]
        most = max((len(columns) for columns in self.columns), default=0)
        self.derivatives = derive_sample(stage.function, active, used, most)
        self.v = plan.allocate(count * len(used))
        value = plan.add_function(self.derivatives.value)
        self.read = PlaceBlock(self.u, m, m, 1, 0)
        plan.add_call(VALUES, Call(value, count, None, (self.read,), (PlaceBlock(self.v, len(used), len(used), 1, 0),)))
        self.outputs = all_outputs
        self.place_outputs(assembler.value_places, self.v)
        self.width = most
        self.rows = self._add_input_rows(assembler, patterns)
        if len(active) and len(used):
            self._add_output_rows(assembler)

    def place_outputs(self, places: Integers, first: int) -> None:
        """Write the places of numbers of all used outputs, sample by sample from the first place, into places (y,)."""
        for place, o in enumerate(self.used):
            numbers = self.before + o + self.outputs * np.arange(self.count)
            places[numbers] = first + place + len(self.used) * np.arange(self.count)

    def _add_input_rows(self, assembler: Assembler, patterns: list[list[Integers]]) -> list[list[Row]]:
        plan, ma = assembler.plan, len(self.active)
        rows: list[list[Row]] = []
        directional = self.derivatives.directional
        changes = not directional
        mark, begin = len(plan.steps[FIRST]), plan.size
        if directional:
            place = plan.allocate(self.count * ma * self.width)
            self.directions = PlaceBlock(place, ma * self.width, ma, self.width, 1)
            self.direction_counts = np.array([len(columns) for columns in self.columns])
        for e, sample_patterns in enumerate(patterns):
            rows.append([])
            for a, pattern in enumerate(sample_patterns):
                entries = self.glue.entries[e * self.m + self.active[a]]
                if directional:
                    places = place + (e * ma + a) * self.width + np.searchsorted(self.columns[e], pattern)
                elif len(entries) == 1 and entries[0][1] == ONE:
                    rows[-1].append(assembler.derivatives[entries[0][0]])
                    continue
                else:
                    places = plan.allocate(len(pattern)) + np.arange(len(pattern))
                rows[-1].append(Row(pattern, places))
                for j, factor in entries:
                    source = assembler.derivatives[j]
                    targets = places[np.searchsorted(pattern, source.columns)]
                    changes |= plan.add_row(FIRST, source, targets, factor)
        if changes:  # else they are constant
            plan.reset(FIRST, begin, plan.size - begin, mark)
        return rows

    def _add_output_rows(self, assembler: Assembler) -> None:
        """Add the call of the first derivatives, and the derivatives of the outputs with respect to the variables."""
        plan, sample, count = assembler.plan, self.derivatives, self.count
        ma, nv = len(self.active), len(self.used)
        number = plan.add_function(sample.first)
        if sample.directional:
            place = plan.allocate(count * nv * self.width)
            write = PlaceBlock(place, nv * self.width, nv, self.width, 1)
            plan.add_call(FIRST, Call(number, count, self.direction_counts, (self.read, self.directions), (write,)))
        else:
            nonzeros = sample.jacobian.nnz()
            place = plan.allocate(count * nonzeros)
            write = PlaceBlock(place, nonzeros, nonzeros, 1, 0)
            plan.add_call(FIRST, Call(number, count, None, (self.read,), (write,)))
        entry = np.full((nv, ma), -1)
        output, source = sample.jacobian.get_triplet()
        entry[output, source] = np.arange(len(output))
        mark, begin = len(plan.steps[FIRST]), plan.size
        for e in range(count):
            for o, name in enumerate(self.used):
                read = np.flatnonzero(entry[o] >= 0)
                rows = [self.rows[e][a] for a in read]
                columns = unite(row.columns for row in rows)
                y = self.before + e * self.outputs + name
                if sample.directional:
                    base = place + (e * nv + o) * self.width
                    assembler.derivatives[y] = Row(columns, base + np.searchsorted(self.columns[e], columns))
                    continue
                slopes = place + e * nonzeros + entry[o, read]
                if all(len(row.places) == 1 and row.places[0] == ONE for row in rows) and len(columns) == len(rows):
                    order = np.argsort([row.columns[0] for row in rows])
                    assembler.derivatives[y] = Row(columns, slopes[order])
                    continue
                row = Row(columns, plan.allocate(len(columns)) + np.arange(len(columns)))
                for given, slope in zip(rows, slopes, strict=True):
                    plan.add_row(FIRST, given, row.places[np.searchsorted(columns, given.columns)], int(slope))
                assembler.derivatives[y] = row
        plan.reset(FIRST, begin, plan.size - begin, mark)
