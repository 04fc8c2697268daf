"""``nlp-gait export``."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from compare.cli.command import FORCE, OUTPUT, command, report_interrupts
from compare.cli.options import Code, name_all
from compare.cli.printing import Output
from compare.judge import find_faults
from compare.study.record import load_result_or_record
from nlp_gait import gaitbench
from nlp_gait.errors import InputError, unknown
from nlp_gait.export.formats import FORMATS, PERIOD_MS, write_as
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
    code: Code = None,
    force: Annotated[bool, Option("--force", help=FORCE)] = False,
) -> Output:
    """Write a gait for other tools or as a page in 3-D, or a problem's objective.

    C++ needs only libc and libm, and has a C header, a build script, an example in C, and callers for MATLAB, Octave and Julia.

    Examples: `nlp-gait export best.json --to webots` after `nlp-gait solve nao-ssp --out best.json`,
    `nlp-gait export best.json --to html`, `nlp-gait export ssp-v5 --to objective --out DIR`, then `sh DIR/build.sh && DIR/main`
    """
    if to not in (*GAITS, OBJECTIVE):
        raise unknown("kind", to, [*GAITS, OBJECTIVE])
    name_all(code)
    if to == OBJECTIVE:
        if out is None:
            raise InputError("--to objective writes several files; name their folder by --out DIR")
        written = export_objective(gaitbench.load(source), out, force)
        return Output(data={"source": source, "kind": to}, written=written)
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


# Kinds of files for a gait: usual ending, and the function that writes it, with the time between rows [ms].
GAITS: Mapping[str, tuple[str, Callable[[Path, Result, int], None]]] = {
    **{name: (ending, partial(write_as, name)) for name, ending in FORMATS.items()},
    "html": (".html", _write_page),
}
OBJECTIVE = "objective"  # of a problem, as C++
