"""An NLP split into the functions that it calls, mapped over samples or once, and the cheap expressions between them (the glue).

y = (w, v_1, ..., v_K),  u_k = glue_k(w, p, v_1, ..., v_{k-1}),  v_k = function_k(u_k) sample by sample,  (f, g) = glue(w, p, v).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import cast

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import CompilerError

CALLED = ("Map", "SXFunction")  # CasADi's classes of functions that become stages


class NotMapped(CompilerError):
    """The graph of an NLP contains something that cannot be split; the message says what."""


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
    """Split an NLP, CasADi's dictionary of x, p, f, g; raises NotMapped for other calls than of ``CALLED``."""
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
        raise NotMapped(str(error).splitlines()[-1]) from error


def _by_sample(matrices: list[SX], count: int) -> SX:
    """Return the nonzeros of matrices, a block of columns for each sample, as one vector, sample by sample."""
    columns = [stack_nonzeros(matrix) for matrix in matrices]
    starts = np.cumsum([0, *(column.shape[0] for column in columns)])
    order = [np.arange(*ends).reshape(count, -1) for ends in zip(starts[:-1], starts[1:], strict=True)]
    return ca.vertcat(*columns)[np.hstack(order).ravel().tolist()]
