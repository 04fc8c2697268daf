"""Expressions between the samples of an NLP: where their values stand, and how they depend on samples and variables."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.derivatives.plan import FIRST, ONE, VALUES, Integers, Plan, Row
from nlp_gait.backends.derivatives.structure import Structure, scalars
from nlp_gait.symbolic.tape import read_tape


class Glue(NamedTuple):
    """Rows of glue and what they mean for derivatives.

    Attributes:
        rows: (r,) expressions.
        places: (r,) of their values.
        entries: for each row the numbers of the y's that it depends on, and places of the derivatives.
    """

    rows: SX
    places: Integers
    entries: list[list[tuple[int, int]]]


class Assembler:
    """A plan in the making: the variables and the outputs of samples, y, with places of their values and derivatives."""

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

    def glue(self, rows: SX, places: Integers) -> Glue:
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
        return Glue(rows, places, entries)

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
        found = np.zeros(self.y.shape[0] + self.structure.p.shape[0], bool)
        for each in read_tape(ca.Function("all", [self.y, self.structure.p], [rows])):
            if each.operation == ca.OP_INPUT:
                found[each.place] = True
        return found[: self.y.shape[0]]
