"""What is computed in which order and where: one memory of doubles, and steps that fill it.

Everything has a place in one array: variables, parameters, inputs and outputs of all samples, derivatives, constants. A step
copies initial values, works through a tape of scalar operations (the glue), adds products of runs of numbers (sparse linear
algebra), or calls a function of one sample for all pairs of a sample and a direction, as many at once as there are lanes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.derivatives.operations import CODES, read_operations

Integers = np.ndarray[Any, np.dtype[np.int64]]
ONE = 0  # place of the number 1
VALUES, FIRST, SECOND = range(3)  # phases
RESET, TAPE, RUNS, PRODUCTS, CALL = range(5)


class Row(NamedTuple):
    """Derivative of a scalar with respect to the variables: (k,) their numbers, ascending, and places of the values."""

    columns: Integers
    places: Integers


class Block(NamedTuple):
    """Numbers that a call reads or writes for sample e and direction d: at base + e sample + i step + d direction, i < length."""

    base: int
    sample: int
    length: int
    step: int
    direction: int


class Call(NamedTuple):
    """A function of one sample for all samples and directions.

    Attributes:
        function: number of the function.
        samples: their number.
        directions: of each sample (samples,), or None where it takes none.
        inputs: in their order; likewise ``outputs``.
    """

    function: int
    samples: int
    directions: Integers | None
    inputs: tuple[Block, ...]
    outputs: tuple[Block, ...]


@dataclass(kw_only=True, eq=False)
class Plan:
    """The memory and the steps; ``Assembler`` fills it.

    Attributes:
        size: doubles of the memory.
        initial: numbers that are there from the beginning, by place; all others are zero.
        functions: of one sample, to be emitted.
        calls: of these.
        tape: (operation, target, argument, argument).
        runs: (target, source, factor, length): adds factor times a run of numbers to another.
        products: (target, source, factor, factor, length): the same with two factors.
        steps: (kind, first, last) of the three phases, which build on each other: values, first and second derivatives.
    """

    size: int = 1
    initial: dict[int, float] = field(default_factory=lambda: {ONE: 1.0})
    functions: list[ca.Function] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)
    tape: list[tuple[int, int, int, int]] = field(default_factory=list)
    runs: list[tuple[int, int, int, int]] = field(default_factory=list)
    products: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    steps: tuple[list[tuple[int, int, int]], ...] = field(default_factory=lambda: ([], [], []))
    _constants: dict[float, int] = field(default_factory=lambda: {1.0: ONE})

    def room(self, count: int) -> int:
        """Place of so many new numbers."""
        place = self.size
        self.size += count
        return place

    def constant(self, value: float) -> int:
        """Place of a constant."""
        if value not in self._constants:
            place = self._constants[value] = self.room(1)
            self.initial[place] = value
        return self._constants[value]

    def reset(self, phase: int, place: int, count: int, before: int | None = None) -> None:
        """Begin a phase's numbers from their initial values, before a step that is there already or after all of them."""
        if count:
            steps = self.steps[phase]
            steps.insert(len(steps) if before is None else before, (RESET, place, count))

    def call(self, phase: int, call: Call) -> None:
        """Call a function of one sample."""
        self.steps[phase].append((CALL, len(self.calls), len(self.calls) + 1))
        self.calls.append(call)

    def function(self, function: ca.Function) -> int:
        """Number of a function that will be emitted."""
        self.functions.append(function)
        return len(self.functions) - 1

    def evaluate(
        self, phase: int, inputs: Sequence[SX], places: Sequence[Integers], outputs: SX, targets: Integers
    ) -> None:
        """Scalar expressions.

        Args:
            phase: that they belong to.
            inputs: vectors of symbols.
            places: of their numbers, -1 for those that are not used.
            outputs: (k,) expressions.
            targets: (k,) their places.
        """
        if not outputs.shape[0]:
            return
        function = ca.Function("glue", list(inputs), [ca.cse(outputs)])
        source = np.concatenate(places) if places else np.zeros(0, int)
        begin = len(self.tape)
        at: list[int] = []
        registers: dict[int, int] = {}
        for each in read_operations(function):
            arguments = [at[k] for k in each.arguments]
            if each.operation == ca.OP_INPUT:
                at.append(int(source[each.place]))
                continue
            if each.operation == ca.OP_CONST:
                at.append(self.constant(each.constant))
                continue
            if each.operation == ca.OP_OUTPUT:
                operation, target = CODES[ca.OP_ASSIGN], int(targets[each.place])
            else:
                operation, target = CODES[each.operation], registers.setdefault(each.register, len(registers))
                target = -1 - target  # settled below, where the number of registers is known
            at.append(target)
            self.tape.append((operation, target, arguments[0], arguments[-1]))
        base = self.room(len(registers))
        for k in range(begin, len(self.tape)):
            operation, *where = self.tape[k]
            target, first, second = (base - 1 - place if place < 0 else place for place in where)
            self.tape[k] = operation, target, first, second
        self._step(phase, TAPE, begin, len(self.tape))

    def add(self, phase: int, row: Row, targets: Integers, factor: int) -> bool:
        """Add factor times a row to targets; True if that is done at run time, False if it went into the initial values."""
        fixed = row.places == ONE
        if factor in self.initial and fixed.all() and self._is_constant(factor):
            for place in targets.tolist():
                self.initial[place] = self.initial.get(place, 0.0) + self.initial[factor]
            return False
        begin = len(self.runs)
        self.runs += [(target, source, factor, length) for target, source, length in _segments(targets, row.places)]
        self._step(phase, RUNS, begin, len(self.runs))
        return True

    def add_product(self, phase: int, row: Row, targets: Integers, first: int, second: int) -> None:
        """Add the product of two factors with a row to targets."""
        if ONE in (first, second):
            begin = len(self.runs)
            factor = second if first == ONE else first
            self.runs += [(target, source, factor, length) for target, source, length in _segments(targets, row.places)]
            self._step(phase, RUNS, begin, len(self.runs))
            return
        begin = len(self.products)
        self.products += [(t, s, first, second, length) for t, s, length in _segments(targets, row.places)]
        self._step(phase, PRODUCTS, begin, len(self.products))

    def _is_constant(self, place: int) -> bool:
        return self._constants.get(self.initial[place]) == place

    def _step(self, phase: int, kind: int, begin: int, end: int) -> None:
        """A step, which goes on with the last one if that is of its kind."""
        steps = self.steps[phase]
        if begin == end:
            return
        if steps and steps[-1][0] == kind and steps[-1][2] == begin:
            begin = steps.pop()[1]
        steps.append((kind, begin, end))


def _segments(targets: Integers, sources: Integers) -> list[tuple[int, int, int]]:
    """Longest parts of two lists of places in which both count upwards by one: target, source, length."""
    if not len(targets):
        return []
    if len(targets) == 1:
        return [(int(targets[0]), int(sources[0]), 1)]
    ends = np.flatnonzero((np.diff(targets) != 1) | (np.diff(sources) != 1)) + 1
    begins = [0, *ends.tolist()]
    return [(int(targets[i]), int(sources[i]), j - i) for i, j in zip(begins, [*begins[1:], len(targets)], strict=True)]
