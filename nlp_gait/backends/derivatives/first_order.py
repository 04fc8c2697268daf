"""First derivatives of a stage: of the inputs of its samples from the glue, of their outputs by the chain rule."""

from __future__ import annotations

import numpy as np

from nlp_gait.backends.derivatives.glue import Assembler, union
from nlp_gait.backends.derivatives.plan import FIRST, ONE, VALUES, Block, Call, Integers, Plan, Row
from nlp_gait.backends.derivatives.sample import derive_sample
from nlp_gait.backends.derivatives.structure import Stage


class Samples:
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
        self.columns = [union(each) for each in patterns]
        most = max((len(each) for each in self.columns), default=0)
        self.derivatives = derive_sample(stage.function, active, used, most)
        self.by_column = self.derivatives.directional and most <= len(active)
        self.v = plan.allocate(count * len(used))
        value = plan.add_function(self.derivatives.value)
        self.read = Block(self.u, m, m, 1, 0)
        plan.add_call(VALUES, Call(value, count, None, (self.read,), (Block(self.v, len(used), len(used), 1, 0),)))
        for place, o in enumerate(used):
            numbers = before + o + all_outputs * np.arange(count)
            assembler.value_places[numbers] = self.v + place + len(used) * np.arange(count)
        self.outputs = all_outputs
        self.width = most if self.by_column else len(active)
        self.rows = self._add_input_rows(assembler, patterns)
        if len(active) and len(used):
            self._add_output_rows(assembler)

    def count_directions(self) -> Integers:
        """Return the number of directions of each sample."""
        if self.by_column:
            return np.array([len(each) for each in self.columns])
        return np.full(self.count, len(self.active))

    def place_directions(self, plan: Plan) -> Block:
        """Return the directions of all samples: columns of the derivatives of their inputs, or the inputs themselves."""
        size = len(self.active)
        if self.by_column:
            return Block(self.d, size * self.width, size, self.width, 1)
        place = plan.allocate(size * size)
        plan.initial |= {place + i * (size + 1): 1.0 for i in range(size)}
        return Block(place, 0, size, size, 1)

    def _add_input_rows(self, assembler: Assembler, patterns: list[list[Integers]]) -> list[list[Row]]:
        """Add the derivatives of active inputs with respect to the variables."""
        plan, ma = assembler.plan, len(self.active)
        rows: list[list[Row]] = []
        if self.by_column:
            self.d = plan.allocate(self.count * ma * self.width)
            mark, changes = len(plan.steps[FIRST]), False
            for e, each in enumerate(patterns):
                rows.append([])
                for a, pattern in enumerate(each):
                    base = self.d + (e * ma + a) * self.width
                    row = Row(pattern, base + np.searchsorted(self.columns[e], pattern))
                    changes |= _add_entries(assembler, row, self.glue.entries[e * self.m + self.active[a]])
                    rows[-1].append(row)
            if changes:  # else they are constant
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
                row = Row(pattern, plan.allocate(len(pattern)) + np.arange(len(pattern)))
                _add_entries(assembler, row, entries)
                rows[-1].append(row)
        plan.reset(FIRST, begin, plan.size - begin, mark)
        return rows

    def _add_output_rows(self, assembler: Assembler) -> None:
        """Add the call of the first derivatives, and the derivatives of the outputs with respect to the variables."""
        plan, found, count = assembler.plan, self.derivatives, self.count
        ma, nv = len(self.active), len(self.used)
        number = plan.add_function(found.first)
        if found.directional:
            place = plan.allocate(count * nv * self.width)
            write = Block(place, nv * self.width, nv, self.width, 1)
            plan.add_call(
                FIRST, Call(number, count, self.count_directions(), (self.read, self.place_directions(plan)), (write,))
            )
        else:
            nonzeros = found.jacobian.nnz()
            place = plan.allocate(count * nonzeros)
            plan.add_call(FIRST, Call(number, count, None, (self.read,), (Block(place, nonzeros, nonzeros, 1, 0),)))
        at = np.full((nv, ma), -1)
        output, source = found.jacobian.get_triplet()
        at[output, source] = np.arange(len(output))
        mark, begin = len(plan.steps[FIRST]), plan.size
        for e in range(count):
            for o, name in enumerate(self.used):
                inputs = np.flatnonzero(at[o] >= 0)
                rows = [self.rows[e][a] for a in inputs]
                columns = union(row.columns for row in rows)
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
                row = Row(columns, plan.allocate(len(columns)) + np.arange(len(columns)))
                for given, slope in zip(rows, slopes, strict=True):
                    plan.add_row(FIRST, given, row.places[np.searchsorted(columns, given.columns)], int(slope))
                assembler.derivatives[y] = row
        plan.reset(FIRST, begin, plan.size - begin, mark)


def _add_entries(assembler: Assembler, row: Row, entries: list[tuple[int, int]]) -> bool:
    """Add up a row of D; return whether that is done at run time."""
    changes = False
    for j, factor in entries:
        source = assembler.derivatives[j]
        changes |= assembler.plan.add_row(
            FIRST, source, row.places[np.searchsorted(row.columns, source.columns)], factor
        )
    return changes
