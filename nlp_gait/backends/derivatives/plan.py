"""Evaluation plan of an NLP: one memory of doubles, and the steps that fill it.

Everything has a place in one array: variables, parameters, inputs and outputs of all samples, derivatives, constants. A step
copies initial values, executes a tape of scalar operations (the glue), adds products of runs of numbers (sparse linear algebra),
or calls a function of one sample for all pairs of a sample and a direction, as many at once as there are lanes.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.errors import CompilerError
from nlp_gait.symbolic.tape import Instruction, read_tape

_UNARY = "EXP LOG SQRT SIN COS TAN ASIN ACOS ATAN SINH COSH TANH FLOOR CEIL FABS SIGN NOT LOG1P EXPM1"
_BINARY = "POW CONSTPOW LT LE EQ NE AND OR FMOD COPYSIGN IF_ELSE_ZERO FMIN FMAX ATAN2 HYPOT"
_NAMES = {"CONSTPOW": "pow", "LT": "less", "LE": "at_most", "EQ": "equal", "NE": "unequal"}  # others have CasADi's
# {f} is the prefix of functions: of lanes or of numbers (``native/operations.hpp``).
_TEXTS = {
    "ASSIGN": "{0}",
    "ADD": "{0} + {1}",
    "SUB": "{0} - {1}",
    "MUL": "{0} * {1}",
    "DIV": "{0} / {1}",
    "NEG": "-{0}",
    "SQ": "{0} * {0}",
    "TWICE": "{0} + {0}",
    "INV": "{f}number(1.0) / {0}",
}
_TEXTS |= {name: f"{{f}}{name.lower()}({{0}})" for name in _UNARY.split()}
_TEXTS |= {name: f"{{f}}{_NAMES.get(name, name.lower())}({{0}}, {{1}})" for name in _BINARY.split()}
EXPRESSIONS: dict[int, str] = {getattr(ca, f"OP_{name}"): text for name, text in _TEXTS.items()}
OPERATIONS = {*EXPRESSIONS, ca.OP_INPUT, ca.OP_CONST, ca.OP_OUTPUT}
CODES = {operation: code for code, operation in enumerate(EXPRESSIONS)}
# Operations in one C++ function: longer ones take the compiler longer per operation, shorter ones pass more values in memory.
PIECE = 500


def read_operations(function: ca.Function) -> Iterator[Instruction]:
    """Yield the instructions of a function of scalar operations; raises CompilerError for one that has no C++ here."""
    for instruction in read_tape(function):
        if instruction.operation not in OPERATIONS:
            raise CompilerError(f"operation {instruction.operation} of function {function.name()}")
        yield instruction


def write_function(name: str, function: ca.Function) -> str:
    """Return C++ of ``void name(const Vector* in, Vector* out)``, with all inputs one after the other, and all outputs.

    It is split into pieces, so that the compile time is proportional to the length.
    """
    tape = list(read_operations(function))
    free = {
        k: f"in[{node.place}]" if node.operation == ca.OP_INPUT else f"v_number({format_number(node.constant)})"
        for k, node in enumerate(tape)
        if node.operation in (ca.OP_INPUT, ca.OP_CONST)
    }
    body = [k for k in range(len(tape)) if k not in free]
    piece = {k: i // PIECE for i, k in enumerate(body)}
    kept: dict[int, int] = {}  # values that later pieces need, by their place in memory
    for k in body:
        for value in tape[k].arguments:
            if value not in free and piece[value] != piece[k]:
                kept.setdefault(value, len(kept))
    pieces = -(-len(body) // PIECE)
    lines: list[str] = []
    for number in range(pieces):
        lines.append(
            f"static NEVER_INLINE void {name}_{number}(const Vector* __restrict in, Vector* __restrict out, "
            "Vector* __restrict kept) {"
        )
        declared: set[int] = set()
        for k in body[number * PIECE : (number + 1) * PIECE]:
            node = tape[k]
            for value in node.arguments:
                if value not in declared:
                    declared.add(value)
                    lines.append(f"const Vector t{value} = {free.get(value) or f'kept[{kept[value]}]'};")
            names = [f"t{value}" for value in node.arguments]
            if node.operation == ca.OP_OUTPUT:
                lines.append(f"out[{node.place}] = {names[0]};")
                continue
            declared.add(k)
            lines.append(f"const Vector t{k} = {EXPRESSIONS[node.operation].format(*names, f='v_')};")
            if k in kept:
                lines.append(f"kept[{kept[k]}] = t{k};")
        lines.append("}")
    calls = " ".join(f"{name}_{number}(in, out, kept);" for number in range(pieces))
    lines.append(f"void {name}(const Vector* in, Vector* out) {{ Vector kept[{len(kept) + 1}]; {calls} }}")
    return "\n".join(lines)


def format_number(value: float) -> str:
    """Return a double as C++, to the last bit."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))


Integers = np.ndarray[Any, np.dtype[np.int64]]
ONE = 0  # place of the number 1
VALUES, FIRST, SECOND = range(3)  # phases
RESET, TAPE, RUNS, PRODUCTS, CALL = range(5)


class Row(NamedTuple):
    """Derivative of a scalar: numbers (k,) of the variables, ascending, and places (k,) of the values."""

    columns: Integers
    places: Integers


class PlaceBlock(NamedTuple):
    """Places that a call uses for sample e and direction d: base + e sample + i step + d direction, i < length."""

    base: int
    sample: int
    length: int
    step: int
    direction: int


class Call(NamedTuple):
    """Call of a function of one sample for all samples and directions."""

    function: int
    samples: int
    directions: Integers | None  #: (samples,) number of directions of each, or None if the function takes none
    inputs: tuple[PlaceBlock, ...]  #: in their order; likewise ``outputs``
    outputs: tuple[PlaceBlock, ...]


@dataclass(kw_only=True, eq=False)
class DerivativePlan:
    """The memory and the steps; ``Assembler`` fills it."""

    size: int = 1  #: of the memory, in doubles
    #: Initial values by place; all others are zero
    initial: dict[int, float] = field(default_factory=lambda: {ONE: 1.0})
    functions: list[ca.Function] = field(default_factory=list)  #: functions of one sample, to be emitted
    calls: list[Call] = field(default_factory=list)
    tape: list[tuple[int, int, int, int]] = field(default_factory=list)  #: (operation, target, argument, argument)
    #: (target, source, factor, length): adds factor times a run of numbers to another run
    runs: list[tuple[int, int, int, int]] = field(default_factory=list)
    #: (target, source, factor, factor, length): the same with two factors
    products: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    #: (kind, first, last) of three phases: values, first derivatives, second derivatives
    steps: tuple[list[tuple[int, int, int]], ...] = field(default_factory=lambda: ([], [], []))
    _constants: dict[float, int] = field(default_factory=lambda: {1.0: ONE})

    def allocate(self, count: int) -> int:
        """Return the place of new numbers."""
        place = self.size
        self.size += count
        return place

    def place_constant(self, value: float) -> int:
        """Return the place of a constant."""
        if value not in self._constants:
            place = self._constants[value] = self.allocate(1)
            self.initial[place] = value
        return self._constants[value]

    def reset(self, phase: int, place: int, count: int, before: int | None = None) -> None:
        """Add a step that sets numbers to their initial values, before an existing step or after all steps."""
        if count:
            steps = self.steps[phase]
            steps.insert(len(steps) if before is None else before, (RESET, place, count))

    def add_call(self, phase: int, call: Call) -> None:
        """Add a call of a function of one sample."""
        self.steps[phase].append((CALL, len(self.calls), len(self.calls) + 1))
        self.calls.append(call)

    def add_function(self, function: ca.Function) -> int:
        """Add a function to be emitted, and return its number."""
        self.functions.append(function)
        return len(self.functions) - 1

    def add_expressions(
        self, phase: int, inputs: Sequence[SX], places: Sequence[Integers], outputs: SX, targets: Integers
    ) -> None:
        """Add scalar expressions (k,) to the tape, with places of their inputs' values (-1 if unused) and of their own."""
        if not outputs.shape[0]:
            return
        function = ca.Function("glue", list(inputs), [ca.cse(outputs)])
        source = np.concatenate(places) if places else np.zeros(0, int)
        begin = len(self.tape)
        value_places: list[int] = []
        registers: dict[int, int] = {}
        for node in read_operations(function):
            arguments = [value_places[k] for k in node.arguments]
            if node.operation == ca.OP_INPUT:
                value_places.append(int(source[node.place]))
                continue
            if node.operation == ca.OP_CONST:
                value_places.append(self.place_constant(node.constant))
                continue
            if node.operation == ca.OP_OUTPUT:
                operation, target = CODES[ca.OP_ASSIGN], int(targets[node.place])
            else:
                operation, target = CODES[node.operation], registers.setdefault(node.register, len(registers))
                target = -1 - target  # replaced below, where the number of registers is known
            value_places.append(target)
            self.tape.append((operation, target, arguments[0], arguments[-1]))
        base = self.allocate(len(registers))
        for k in range(begin, len(self.tape)):
            operation, *where = self.tape[k]
            target, first, second = (base - 1 - place if place < 0 else place for place in where)
            self.tape[k] = operation, target, first, second
        self._add_step(phase, TAPE, begin, len(self.tape))

    def add_row(self, phase: int, row: Row, targets: Integers, factor: int) -> bool:
        """Add factor times a row to targets: in a step (returns True), or in the initial values if all is constant."""
        is_constant = factor in self.initial and self._constants.get(self.initial[factor]) == factor
        if is_constant and (row.places == ONE).all():
            for place in targets.tolist():
                self.initial[place] = self.initial.get(place, 0.0) + self.initial[factor]
            return False
        self._add_runs(phase, row, targets, factor)
        return True

    def _add_runs(self, phase: int, row: Row, targets: Integers, factor: int) -> None:
        begin = len(self.runs)
        self.runs += [(target, source, factor, length) for target, source, length in find_runs(targets, row.places)]
        self._add_step(phase, RUNS, begin, len(self.runs))

    def add_product(self, phase: int, row: Row, targets: Integers, first: int, second: int) -> None:
        """Add the product of two factors and a row to targets."""
        if ONE in (first, second):
            self._add_runs(phase, row, targets, second if first == ONE else first)
            return
        begin = len(self.products)
        self.products += [(t, s, first, second, length) for t, s, length in find_runs(targets, row.places)]
        self._add_step(phase, PRODUCTS, begin, len(self.products))

    def _add_step(self, phase: int, kind: int, begin: int, end: int) -> None:
        """Add a step, or extend the last one if it is of the same kind."""
        steps = self.steps[phase]
        if begin == end:
            return
        if steps and steps[-1][0] == kind and steps[-1][2] == begin:
            begin = steps.pop()[1]
        steps.append((kind, begin, end))


def find_runs(targets: Integers, sources: Integers) -> list[tuple[int, int, int]]:
    """Split two lists of places into runs in which both increase by one; return target, source, length of each."""
    places = list(zip(targets.tolist(), sources.tolist(), strict=True))
    ends = [k for k, (t, s) in enumerate(places[1:], 1) if places[k - 1] != (t - 1, s - 1)]
    return [(*places[begin], end - begin) for begin, end in pairwise([0, *ends, len(places)]) if places]
