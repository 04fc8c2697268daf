"""A page for each problem, generated from the problem and from measurements (``docs/difficulty.json``)."""

from __future__ import annotations

import importlib
import inspect
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

from compare.analysis.units import with_unit
from docs.difficulty import Best, Difficulty, Reached, difficulties
from docs.pages.markdown import code, literal, page, table, toctree, write_all
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem, list_problems, load
from nlp_gait.formulation.registry import describe_options, find_maker, list_choices
from nlp_gait.formulation.solution import ConstraintValue
from nlp_gait.gaitbench.facts import DEFINITIONS, load_facts
from nlp_gait.proofs.certificate import load_certificates
from nlp_gait.providers import PROBLEMS
from nlp_gait.symbolic.nonsmooth import Exact

GAITS = "gaits"  # folder at the root of the site, see ``front``
LEFT_OUT = ("gaitbench",)  # a suite, with a page of its own
SHOWN = 12  # variables, and binding rows, on a page
SAME = 1e-6  # relative; another processor rounds otherwise
SOURCE = re.compile(r"^Source:\n((?: {4}.+\n?)+)", re.MULTILINE)
INTRODUCTION = """# Problems

Each page is generated from the problem; figures of solvers were measured by `python -m docs.difficulty` with default
options and values. Near: within 0.1 % of the best known point. [GaitBench](../../gaitbench.md) freezes variants of them, and
[your own](../../researcher.md) is used as `FILE.py:NAME`."""
SIZES = Path(__file__).parents[1] / "nlp_sizes.json"
KEYS = ("variables", "lifted", "constraints", "equations", "jacobian", "hessian")  # of SIZES
SIZES_INTRODUCTION = """## Sizes of the NLPs

What NLP solvers receive with default options: scaled variables and those of lifted operations, the lower triangle of the Hessian;
measured by `python -m docs.nlp_sizes`."""
INSTANCES = """## Instances of GaitBench

An asterisk marks those of the subset `small`. *Feasible* is the share of 100,000 uniform points, *cost* the processor time of
one evaluation in a batch, on one core with AVX-512. *Evidence* says why the best known may be the optimum: a proof by branch and
bound, the random starts of IPOPT that reach it within a millionth, and long runs of CMA-ES. "Best known" alone means that one
start found it."""
CERTIFICATES = """## Certificates

Bounds that are [proven](../../guarantees.md) by branch and bound over all variables, with the boxes that the proof took
and its time on one core."""


def names() -> list[str]:
    """Return the problems that have a page."""
    return [name for name in list_problems() if name not in LEFT_OUT]


def write(folder: Path) -> None:
    """Write an index, and a page and a figure for each problem."""
    folder, measured = folder / "problems", difficulties()
    folder.mkdir(parents=True, exist_ok=True)
    problems = {name: load(name) for name in names()}
    pages = {f"{name}.md": problem_page(problem, measured.get(name)) for name, problem in problems.items()}
    header = ("problem", "what", "variables", "best known", "feasible points", "IPOPT near", "searches near")
    rows = [_overview(problem, measured.get(name)) for name, problem in problems.items()]
    pages["index.md"] = page(
        INTRODUCTION,
        table(header, rows),
        list_options(list(problems.values())),
        SIZES_INTRODUCTION,
        nlp_sizes(),
        INSTANCES,
        list_instances(),
        CERTIFICATES,
        list_certificates(),
        toctree(problems),
    )
    write_all(folder, pages)


def nlp_sizes() -> str:
    """Return the table of the NLPs' sizes."""
    measured = json.loads(SIZES.read_text(encoding="utf-8"))
    header = (
        "problem",
        "variables",
        "of these lifted",
        "constraints",
        "of these equations",
        "nonzeros of the Jacobian",
        "of the Hessian",
    )
    return table(header, [(f"`{name}`", *(f"{measured[name][key]:,}" for key in KEYS)) for name in names()])


def list_instances() -> str:
    """Return the table of GaitBench's instances."""
    header = ("id", "what", "n", "feasible", "cost", "best known", "evidence")
    facts = load_facts()
    return table(
        header,
        (
            (
                code(definition.id) + " \\*" * definition.small,
                literal(definition.what),
                str(len(facts[definition.id].best_x)),
                f"{100 * facts[definition.id].feasible_share:.2g} %",
                f"{facts[definition.id].evaluation_us:.2g} us",
                f"{facts[definition.id].best_known:.6g}",
                literal(str(facts[definition.id].evidence)),
            )
            for definition in DEFINITIONS
        ),
    )


def list_certificates() -> str:
    """Return the table of the shipped certificates."""
    header = ("certificate", "best known", "proven bound", "boxes", "s of one core")
    proofs = {name: file.certificate for name, file in load_certificates().items()}
    return table(
        header,
        (
            (code(name), f"{proof.objective:.7g}", f"{proof.bound:.7g}", f"{proof.boxes:,}", f"{proof.cpu_s:.0f}")
            for name, proof in proofs.items()
        ),
    )


def _overview(problem: GaitProblem, found: Difficulty | None) -> tuple[str, ...]:
    first = (f"[`{problem.name}`]({problem.name}.md)", literal(problem.title), str(len(problem.names)))
    if found is None:
        return (*first, "", "not measured", "", "")
    searches = [f"{solver} {_share(reached)}" for solver, reached in found.solvers.items() if solver != "ipopt"]
    ipopt = found.solvers.get("ipopt")
    return (
        *first,
        "" if found.best is None else with_unit(found.best.objective, problem.objective.unit, ".6g"),
        _feasible(found),
        "" if ipopt is None else _share(ipopt),
        ", ".join(searches) or "cannot be searched",
    )


def _share(reached: Reached) -> str:
    return f"{reached.near}/{reached.runs}"


def _feasible(found: Difficulty) -> str:
    if not found.points:
        return "-"
    if not found.feasible_points:
        return f"none of {found.points}"
    return f"{100.0 * found.feasible_points / found.points:.3g} %"


def problem_page(problem: GaitProblem, found: Difficulty | None) -> str:
    """Return the page of a problem."""
    best = None if found is None else found.best
    return page(
        f"# {problem.name}",
        f"**{literal(problem.title)}.** {literal(_words(problem))}",
        frame_gait(problem.name) if best is not None and problem.display.skeleton is not None else "",
        best_section(problem, found),
        _variables(problem, best),
        _binding(problem, best),
        _rows(problem),
        _parameters(problem),
        _options(problem),
        _difficulty(problem, found),
        "## Source",
        literal(_source(problem)),
        _use(problem),
    )


def _words(problem: GaitProblem) -> str:
    """Return the first paragraph of its module's docstring after the title, or else of its maker's."""
    module = inspect.getdoc(importlib.import_module(PROBLEMS[problem.name].partition(":")[0])) or ""
    return " ".join(" ".join(module.split("\n\n")[:2]).split())


def frame_gait(name: str) -> str:
    """Return the frame of the page that plays a gait, which is loaded when it is scrolled into view."""
    address = f"../../{GAITS}/{name}.html"
    return (
        f'<iframe class="gait" src="{address}" loading="lazy" title="The best known gait of {name} in 3-D"></iframe>\n\n'
        f'Play, drag to turn; <a href="{address}">on a page of its own</a>.'
    )


def best_section(problem: GaitProblem, found: Difficulty | None) -> str:
    """Return the section on the best known objective.

    Raises:
        ValueError: the problem has changed since it was measured.
    """
    objective = problem.objective
    title = f"## Best known {objective.name}"
    if found is None or found.best is None:
        return f"{title}\n\nNot measured yet: `python -m docs.difficulty {problem.name}`."
    best, exact = found.best, build_exact_model(problem)
    value = objective.sign * exact.at(problem.check_x(best.x), problem.p).cost
    if not math.isclose(value, best.objective, rel_tol=SAME):
        raise ValueError(
            f"docs/difficulty.json has {best.objective} as the best of {problem.name!r}, but the judge finds {value} there: "
            f"the problem has changed; measure it again by python -m docs.difficulty {problem.name}"
        )
    text = [
        f"**{with_unit(best.objective, objective.unit, '.8g')}**, to {objective.sense}; found by {best.solver}.",
    ]
    for definition in DEFINITIONS:
        same = definition.problem == problem.name and not definition.values and not definition.held
        if same and definition.options.items() <= problem.options.items():
            text.append(f"As instance `{definition.id}` of GaitBench: {load_facts()[definition.id].evidence}.")
    return f"{title}\n\n{' '.join(text)}"


def _variables(problem: GaitProblem, best: Best | None) -> str:
    header = ("variable", "lower", "upper", "unit", *(() if best is None else ("best known",)), "what")
    rows = [
        (
            *(code(v.name), f"{v.lower:g}", f"{v.upper:g}", literal(v.unit)),
            *(() if best is None else (f"{best.x[v.name]:.6g}",)),
            literal(v.description),
        )
        for v in problem.variables[:SHOWN]
    ]
    left = len(problem.variables) - len(rows)
    more = f"And {left} more: `nlp-gait list {problem.name}`." if left else ""
    return page("## Variables", table(header, rows), more).strip()


def _binding(problem: GaitProblem, best: Best | None) -> str:
    if best is None or not best.active_constraints:
        return ""
    rows = [
        (code(a.name), a.side, with_unit(a.bound, a.unit, "g"), literal(f"{a.price:+.4g} {a.price_unit}"))
        for a in best.active_constraints[:SHOWN]
    ]
    left = len(best.active_constraints) - len(rows)
    words = f"The price is the change of the best {problem.objective.name} per unit by which the bound is raised."
    words += f" {left} lower prices are omitted." if left else ""
    return page("## What binds it", words, table(("bound", "side", "at", "price"), rows)).strip()


def _rows(problem: GaitProblem) -> str:
    """Groups of rows with their numbers and bounds; bounds depend on parameters alone."""
    exact = build_exact_model(problem)
    values = exact.rows(exact.at(problem.lower, problem.p))[: -len(problem.names)]
    over = {c.name: c.over for c in problem.assemble(problem.symbols(), Exact()).constraints}
    groups: dict[str, list[ConstraintValue]] = {}
    for row in values:
        groups.setdefault(row.name.partition("[")[0], []).append(row)
    rows = [
        (
            *(code(name), str(len(group)), literal(group[0].unit)),
            *(_range([getattr(row, end) for row in group]) for end in ("lower", "upper")),
            (over.get(name) or "").replace("-", " "),
        )
        for name, group in groups.items()
    ]
    sides = sum((row.lower is not None) + (row.upper is not None) for row in values)
    words = f"{len(values)} constraints in {len(groups)} groups; as one-sided inequalities they are {sides}."
    header = ("group", "constraints", "unit", "lower", "upper", "of each")
    return page("## Constraints", words, table(header, rows)).strip()


def _range(bounds: list[float | None]) -> str:
    given = [bound for bound in bounds if bound is not None]
    if not given:
        return ""
    low, high = min(given), max(given)
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def _parameters(problem: GaitProblem) -> str:
    if not problem.own_parameters:
        return ""
    limits = [q for q in problem.own_parameters if q.name.endswith((".lower", ".upper"))]
    others = [q for q in problem.own_parameters if q not in limits]
    rows = [(code(q.name), f"{q.default:g}", literal(q.unit), literal(q.description)) for q in others]
    more = f"And {len(limits)} limits such as `{limits[0].name}`, see `nlp-gait list {problem.name}`." if limits else ""
    return page("## Parameters", table(("parameter", "default", "unit", "what"), rows), more).strip()


def _options(problem: GaitProblem) -> str:
    make = find_maker(problem.name)
    choices = list_choices(make)
    rows = [
        (code(name), code(str(parameter.default)), ", ".join(map(code, choices.get(name, ()))))
        for name, parameter in inspect.signature(make).parameters.items()
    ]
    text = "What they mean is [in one table](index.md#options)."
    return page("## Options", text, table(("option", "default", "one of"), rows)).strip()


def list_options(problems: Sequence[GaitProblem]) -> str:
    """Return the meaning of every option once, with the problems where it means this."""
    meanings: dict[tuple[str, str], list[str]] = {}
    for problem in problems:
        make = find_maker(problem.name)
        words = describe_options(make)
        for name in inspect.signature(make).parameters:
            meanings.setdefault((name, words.get(name, "")), []).append(problem.name)
    rows = [(code(name), literal(words), ", ".join(users)) for (name, words), users in sorted(meanings.items())]
    text = "`--set NAME=VALUE`, or keywords of `nlp_gait.load`; parameters and bounds are set alike, without rebuilding anything."
    return page("## Options", text, table(("option", "what", "of"), rows)).strip()


def _difficulty(problem: GaitProblem, found: Difficulty | None) -> str:
    if found is None:
        return "## Difficulty\n\nNot measured yet."
    rows = [
        (
            *(solver, str(r.runs), str(r.feasible), str(r.near)),
            "" if r.median_gap is None else f"{100.0 * max(r.median_gap, 0.0):.2g} %",
        )
        for solver, r in found.solvers.items()
    ]
    if found.points:
        words = (
            f"{_feasible(found)} of {found.points} uniform random points within the bounds are feasible"
            if found.feasible_points
            else f"None of {found.points} uniform random points within the bounds is feasible"
        )
        words += f"; an evaluation takes {found.evaluation_us:.3g} µs, a run of a search has {found.evaluations}."
    else:
        words = "Its variables satisfy equations, so no candidate of a search is feasible: gradient methods only."
    header = ("solver", "runs", "feasible", "within 0.1 %", "median distance")
    return page("## Difficulty", words, table(header, rows)).strip()


def _source(problem: GaitProblem) -> str:
    """Return the section ``Source:`` of its maker's docstring."""
    text = SOURCE.search(f"{inspect.getdoc(find_maker(problem.name))}\n")
    if text is None:
        raise ValueError(f"the docstring of the maker of {problem.name!r} has no section 'Source:'")
    return " ".join(text[1].split())


def _use(problem: GaitProblem) -> str:
    search = f"nlp-gait compare {problem.name} --out study\n" if problem.searchable else ""
    return (
        f"## Try it\n\n```sh\nnlp-gait solve {problem.name} --out best.json\n{search}nlp-gait list {problem.name}\n```"
    )
