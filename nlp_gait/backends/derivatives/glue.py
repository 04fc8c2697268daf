"""Expressions between the samples of an NLP: places of their values, and dependence on samples and variables."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.derivatives.plan import FIRST, ONE, VALUES, DerivativePlan, Integers, Row
from nlp_gait.backends.derivatives.structure import Structure, scalars
from nlp_gait.symbolic.tape import read_tape


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
        self.used = self._find_used()

    def add_glue(self, rows: SX, places: Integers) -> Glue:
        """Add rows, evaluated to places, and their derivatives with respect to y."""
        self.evaluate(VALUES, rows, places)
        J = ca.jacobian(rows, self.y)
        values = scalars(J)
        varying = [k for k, value in enumerate(values) if not value.is_constant()]
        factors = np.array([self.plan.place_constant(float(v)) if v.is_constant() else -1 for v in values], int)
        factors[varying] = self.plan.allocate(len(varying)) + np.arange(len(varying))
        self.evaluate(FIRST, ca.vertcat(SX(0, 1), *(values[k] for k in varying)), factors[varying])
        entries: list[list[tuple[int, int]]] = [[] for _ in range(rows.shape[0])]
        for i, j, factor in zip(*J.sparsity().get_triplet(), factors.tolist(), strict=True):
            entries[i].append((j, factor))
        return Glue(rows, places, entries)

    def evaluate(self, phase: int, outputs: SX, targets: Integers, *more: tuple[SX, Integers]) -> None:
        """Add expressions of y, p and more symbols; constants go into the initial values."""
        listed = scalars(ca.densify(outputs))
        varying = [k for k, each in enumerate(listed) if not each.is_constant()]
        constants = {int(targets[k]): float(each) for k, each in enumerate(listed) if each.is_constant()}
        self.plan.initial.update(constants)
        p = self.structure.p
        inputs = [self.y, p, *(symbols for symbols, _ in more)]
        places = [self.value_places, self.p + np.arange(p.shape[0]), *(place for _, place in more)]
        expressions = ca.vertcat(SX(0, 1), *(listed[k] for k in varying))
        self.plan.add_expressions(phase, inputs, places, expressions, targets[varying])

    def columns(self, entries: list[tuple[int, int]]) -> Integers:
        """Return the variables that a row of glue depends on, ascending."""
        return union(self.derivatives[j].columns for j, _ in entries)

    def _find_used(self) -> Integers:
        rows = ca.vertcat(*(stage.inputs for stage in self.structure.stages), self.structure.rows)
        found = np.zeros(self.y.shape[0] + self.structure.p.shape[0], bool)
        for each in read_tape(ca.Function("all", [self.y, self.structure.p], [rows])):
            if each.operation == ca.OP_INPUT:
                found[each.place] = True
        return found[: self.y.shape[0]]


def union(parts: Iterable[Integers]) -> Integers:
    """Return all numbers of some arrays, ascending."""
    return np.unique(np.concatenate([np.zeros(0, int), *parts]))
