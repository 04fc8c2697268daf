"""``nlp-gait export``."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from compare.cli.command import FORCE, OUTPUT, command, report_interrupts
from compare.cli.options import Code, Limits, ProblemOptions, Values, name_all
from compare.cli.printing import Output
from compare.judge import find_faults
from compare.study.record import load_result_or_record
from nlp_gait import gaitbench
from nlp_gait.errors import InputError, unknown
from nlp_gait.export.formats import FORMATS, PERIOD_MS, write_as
from nlp_gait.export.solver import export_solver
from nlp_gait.files import check_output
from nlp_gait.formulation import Result
from nlp_gait.gaitbench.c_export import export_objective


@command
def export(
    source: Annotated[str, Argument(metavar="RESULT.json|PROBLEM")],
    *,
    to: Annotated[str, Option(metavar="KIND")],
    out: Annotated[Path | None, OUTPUT] = None,
    period_ms: Annotated[int, Option(min=1, max=86400000)] = PERIOD_MS,
    values: Values = None,
    limits: Limits = None,
    code: Code = None,
    force: Annotated[bool, Option("--force", help=FORCE)] = False,
) -> Output:
    """Write a gait for other tools or as a page in 3-D, or a problem for other solvers.

    C++ needs only libc and libm, and has a C header, a build script, an example in C, and for `objective` callers for MATLAB,
    Octave and Julia.

    Examples: `nlp-gait export best.json --to webots` after `nlp-gait solve nao-ssp --out best.json`,
    `nlp-gait export best.json --to html`, `nlp-gait export ssp-v5 --to objective --out DIR`,
    `nlp-gait export nao-ssp --to solver --out DIR`, then `sh DIR/build.sh && DIR/main`
    """
    if to not in (*GAITS, *PROBLEMS):
        raise unknown("kind", to, [*GAITS, *PROBLEMS])
    name_all(code)
    changes = ProblemOptions(values=values, limits=limits)
    if to in PROBLEMS:
        if out is None:
            raise InputError(f"--to {to} writes several files; name their folder by --out DIR")
        return Output(data={"source": source, "kind": to}, written=PROBLEMS[to](source, changes, out, force))
    if changes != ProblemOptions():
        raise InputError(f"--to {to} writes a stored gait with its own options and values; leave out --set and --limit")
    ending, write = GAITS[to]
    result, path = load_result_or_record(Path(source)), Path(source)
    target = check_output(out or path.with_name(path.stem + ending), force)
    faults = find_faults(result, path)
    with report_interrupts():
        write(target, result, period_ms)
    return Output(data={"source": source, "kind": to, "faults": faults}, parts=faults, written=[target])


def _write_page(path: Path, result: Result, period_ms: int) -> None:
    from compare.report.interactive import animate_gait

    animate_gait(result.problem, result.x, result.problem.name).write(path)


def _write_objective(source: str, changes: ProblemOptions, folder: Path, force: bool) -> list[Path]:
    if changes != ProblemOptions():
        raise InputError("--to objective writes an instance as it is; leave out --set and --limit")
    return export_objective(gaitbench.load(source), folder, force)


def _write_solver(source: str, changes: ProblemOptions, folder: Path, force: bool) -> list[Path]:
    return export_solver(changes.make_spec(source).load(), folder, force)


# Kinds of files for a gait: usual ending, and the function that writes it, with the time between rows [ms].
GAITS: Mapping[str, tuple[str, Callable[[Path, Result, int], None]]] = {
    **{name: (ending, partial(write_as, name)) for name, ending in FORMATS.items()},
    "html": (".html", _write_page),
}
PROBLEMS: Mapping[str, Callable[[str, ProblemOptions, Path, bool], Sequence[Path]]] = {
    "objective": _write_objective,
    "solver": _write_solver,
}
