"""First derivatives of a stage: of its samples' inputs from the glue, of their outputs by the chain rule."""

from __future__ import annotations

import numpy as np

from nlp_gait.backends.derivatives.glue import Assembler
from nlp_gait.backends.derivatives.plan import FIRST, ONE, VALUES, Block, Call, Integers, Plan, Row
from nlp_gait.backends.derivatives.sample import derive_sample
from nlp_gait.backends.derivatives.structure import Stage


class Samples:
    """A stage: where its inputs and outputs stand, and rows of derivatives of both."""

    def __init__(self, assembler: Assembler, stage: Stage, before: int) -> None:
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
        self.derivatives = derive_sample(stage.function, active, used, count, most)
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

    def seeds(self, plan: Plan) -> Block:
        """Directions of all samples: columns of their inputs' derivatives, or the inputs themselves."""
        size = len(self.active)
        if self.by_column:
            return Block(self.d, size * self.width, size, self.width, 1)
        place = plan.room(size * size)
        plan.initial |= {place + i * (size + 1): 1.0 for i in range(size)}
        return Block(place, 0, size, size, 1)

    def _input_rows(self, assembler: Assembler, patterns: list[list[Integers]]) -> list[list[Row]]:
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

    def _output_rows(self, assembler: Assembler) -> None:
        """Call for the first derivatives, and derivatives of the outputs with respect to the variables."""
        plan, found, count = assembler.plan, self.derivatives, self.count
        ma, nv = len(self.active), len(self.used)
        number = plan.function(found.first)
        if found.directional:
            place = plan.room(count * nv * self.width)
            write = Block(place, nv * self.width, nv, self.width, 1)
            plan.call(FIRST, Call(number, count, self.directions(), (self.read, self.seeds(plan)), (write,)))
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


def _filled(assembler: Assembler, row: Row, entries: list[tuple[int, int]]) -> bool:
    """Add up a row of D; True if that is done at run time."""
    moved = False
    for j, factor in entries:
        source = assembler.derivatives[j]
        moved |= assembler.plan.add(FIRST, source, row.places[np.searchsorted(row.columns, source.columns)], factor)
    return moved
