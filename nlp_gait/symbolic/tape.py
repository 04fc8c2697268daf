"""Reader of CasADi's instruction tapes: the scalar operations of a function in their order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import accumulate
from typing import NamedTuple

import casadi as ca


class Instruction(NamedTuple):
    """An operation on the results of earlier instructions."""

    operation: int  #: CasADi's number of the operation
    arguments: tuple[int, ...] = ()  #: indices of earlier instructions
    place: int = -1  #: index of an input or an output among the nonzeros of all inputs or all outputs
    constant: float = 0.0  #: value of a constant
    register: int = -1  #: place in CasADi's work vector at which the result is stored; -1 for outputs


def read_tape(function: ca.Function) -> Iterator[Instruction]:
    """Yield the instructions of a function, expanded to scalar operations; raises RuntimeError where that is impossible."""
    scalar = function if function.is_a("SXFunction") else function.expand()
    first_input = list(accumulate((scalar.nnz_in(i) for i in range(scalar.n_in())), initial=0))
    first_output = list(accumulate((scalar.nnz_out(i) for i in range(scalar.n_out())), initial=0))
    writer: dict[int, int] = {}  # instruction that last wrote each register
    for k in range(scalar.n_instructions()):
        operation, read, written = scalar.instruction_id(k), scalar.instruction_input(k), scalar.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            yield Instruction(operation, (writer[read[0]],), place=first_output[written[0]] + written[1])
            continue
        register = written[0]
        if operation == ca.OP_INPUT:
            yield Instruction(operation, place=first_input[read[0]] + read[1], register=register)
        elif operation == ca.OP_CONST:
            yield Instruction(operation, constant=float(scalar.instruction_constant(k)), register=register)
        else:
            yield Instruction(operation, tuple(writer[place] for place in read), register=register)
        writer[register] = k
