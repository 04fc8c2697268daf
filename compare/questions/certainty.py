"""Evidence that the best known optimum is the global one: what is proven, and what is only supported."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from compare.analysis.units import with_unit
from compare.questions.question import Answer, Question, Work
from compare.report.document import make_text_table
from compare.study.references import find_reference
from compare.study.run import describe_problem
from nlp_gait.backends.exact import hash_json, identify_problem, make_key
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.files import replace_nan
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaitbench.facts import SIX_DIGITS
from nlp_gait.proofs.bounds import has_power_form
from nlp_gait.proofs.branch_and_bound import TOLERANCE, certify
from nlp_gait.proofs.certificate import PROVER, Certificate, make_certificate_file

# Branch and bound is for this many variables, because its work grows exponentially with them; a least-power form allows nine.
MOST_VARIABLES = 4
FIRST_STARTS = 20  # before a proof that branch and bound may give at once
LISTED = 10  # best distinct optima
BATCH = 250  # starts that are stored together
# Ends are one optimum if their objectives differ by no more than this, relative, and no variable by more than this share of its
# range.
SAME_OBJECTIVE = 1e-5
SAME_X = 0.01
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class StartEnd:
    """End of a start."""

    x: tuple[float, ...]  #: (n,)
    objective: float  #: exact value, in the problem's sense
    feasible: bool  #: converged, and feasible for the exact functions
    status: str  #: in words


@dataclass(frozen=True, kw_only=True)
class LocalOptimum:
    """Distinct local optimum."""

    objective: float  #: of its best end, in the problem's sense
    count: int  #: number of starts that reached it
    share: float  #: of the starts that converged
    x: tuple[float, ...]  #: of its best end


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundCertainty:
    """Evidence that the best known optimum is the global one."""

    problem: GaitProblem  #: with its parameter values
    starts: int  #: of IPOPT
    statuses: dict[str, int]  #: number of starts by their status
    optima: tuple[LocalOptimum, ...]  #: distinct local optima, best first
    largest_missed: float  #: share of starts that one unseen optimum attracts, at most, with 95 % confidence
    certificate: Certificate | None  #: None if it was not requested, or branch and bound is not possible

    @property
    def proven(self) -> str:
        """What is proven, in one sentence."""
        c = self.certificate
        if c is None:
            n = len(self.problem.names)
            too_many = f"branch and bound takes at most {MOST_VARIABLES} variables, this problem has {n}"
            return f"nothing: {too_many if n > MOST_VARIABLES else 'no proof was requested'}"
        if not math.isfinite(c.bound):
            return f"nothing: the time limit was reached before a finite bound, after {c.boxes:,} boxes"
        unit = self.problem.objective.unit
        bound, best = (with_unit(value, unit, ".9g") for value in (c.bound, c.objective))
        word = "no feasible x exceeds" if self.problem.objective.sign < 0 else "no feasible x falls below"
        return (
            ("globally optimal to six digits: " if c.gap <= SIX_DIGITS else "")
            + f"{word} {bound}, {100 * c.gap:.3g} % from the best known {best}; "
            + ("the tolerance was reached" if c.closed else "the time limit was reached before the tolerance")
            + "; bounds are rounded outward, functions of libm are assumed to be within four units in the last place"
        )

    @property
    def supported(self) -> str:
        """What is only supported, in one sentence."""
        best = self.optima[0]
        return (
            f"{best.count} of {sum(o.count for o in self.optima)} converged starts reach the best of {len(self.optima)} "
            f"distinct optima; with 95 % confidence no unseen one attracts more than "
            f"{100 * self.largest_missed:.2g} % of starts"
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain data, without the ends of the starts."""
        proof = None if self.certificate is None else {**asdict(self.certificate), "gap": self.certificate.gap}
        plain = replace_nan({name: value for name, value in vars(self).items() if name != "problem"})
        words = {"proven": self.proven, "supported": self.supported}
        return {**describe_problem(self.problem), **plain, "certificate": proof, **words}


@dataclass(frozen=True, kw_only=True, eq=False)
class Certainty(Question[FoundCertainty]):
    """How certain is it that the best known optimum is the global one: a proof where possible, and many starts.

    With few variables a proof is tried at once, from the best of some starts; many starts follow only if it fails.
    """

    name: ClassVar[str] = "certainty"

    starts: int  #: of IPOPT, at most
    tolerance: float = TOLERANCE  #: of the proof, relative
    time_limit_s: float = 1800.0  #: of the proof [s]; 0 for none
    seed: int = 0  #: of the starts

    def __post_init__(self) -> None:
        """Validate the limits of the proof.

        Raises:
            InputError: tolerance or time limit are not allowed.
        """
        if not (0.0 < self.tolerance < 1.0 and 0.0 <= self.time_limit_s < math.inf):
            raise InputError(
                "the tolerance must be between 0 and 1, the time limit finite and >= 0 s; "
                f"got {self.tolerance}, {self.time_limit_s} s"
            )

    def find(self, work: Work) -> Iterator[FoundCertainty]:
        """Yield the evidence.

        Raises:
            InputError: no start converged.
            CompilerError: a proof is requested and there is no compiler.
        """
        problem = self.problem
        is_small = len(problem.names) <= MOST_VARIABLES
        proves = self.time_limit_s > 0.0 and (is_small or has_power_form(problem))
        starts = min(self.starts, FIRST_STARTS) if proves and is_small else self.starts
        ends = run_stored_starts(problem, work, starts=starts, seed=self.seed)
        certificate = self._prove(cluster_ends(problem, ends), work) if proves else None
        if starts < self.starts and (certificate is None or not certificate.closed):
            ends = run_stored_starts(problem, work, starts=self.starts, seed=self.seed)
        optima = cluster_ends(problem, ends)
        if not optima:
            raise InputError(
                f"none of {len(ends)} starts of {problem.name} converged to a feasible point; try more starts"
            )
        yield FoundCertainty(
            problem=problem,
            starts=len(ends),
            statuses=dict(Counter(end.status for end in ends)),
            optima=tuple(optima),
            largest_missed=bound_missed(sum(optimum.count for optimum in optima)),
            certificate=certificate,
        )

    def _prove(self, optima: Sequence[LocalOptimum], work: Work) -> Certificate | None:
        """Return the proof from the best optimum, or from the shipped one; None without either."""
        problem, folder = self.problem, work.memo.folder
        if not optima:
            return None
        best, x = optima[0].objective, optima[0].x
        reference = find_reference(identify_problem(problem))
        if reference.objective is not None and problem.objective.sign * (best - reference.objective) > 0.0:
            x = reference.x
        identity = {**identify_problem(problem), "best": list(x)}
        limits = {"tolerance": self.tolerance, "time_limit_s": self.time_limit_s}

        def prove() -> Certificate:
            name = f"proof-{hash_json({**make_key(identity), 'tolerance': self.tolerance})[:12]}.npz"
            checkpoint = None if folder is None else folder / name
            return certify(problem, np.array(x), **limits, progress=work.progress, checkpoint=checkpoint)

        return work.compute(Certificate, "certificate", {**identity, **limits, "prover": PROVER}, prove)

    def get_optimum(self, findings: FoundCertainty) -> float:
        return findings.optima[0].objective

    def report(self, findings: FoundCertainty) -> Answer:
        problem, unit = findings.problem, findings.problem.objective.unit
        stem = f"{problem.name}-certainty"
        proof = findings.certificate
        optima = [
            (with_unit(o.objective, unit), f"{o.count:,}", f"{100 * o.share:.2f} %") for o in findings.optima[:LISTED]
        ]
        statuses = [(status, f"{count:,}") for status, count in findings.statuses.items()]
        listed = f"Distinct optima of {findings.starts:,} starts, {len(optima)} shown"
        certificates = {}
        if proof is not None and proof.closed:
            certificates[f"{problem.name}-certificate"] = asdict(make_certificate_file(problem, proof))
        return Answer(
            stem=stem,
            title=f"{problem.name}: certainty of the optimum",
            headline=(f"Proven: {findings.proven}.", f"Supported: {findings.supported}."),
            parts=(
                make_text_table((problem.objective.name, "starts", "share"), optima, listed),
                make_text_table(("status", "starts"), statuses, "Status of the starts"),
            ),
            results=certificates,
            data=findings.to_json(),
        )


def run_stored_starts(
    problem: GaitProblem, work: Work, *, starts: int, seed: int = 0, solver: Solver | None = None
) -> list[StartEnd]:
    """Run a solver (by default IPOPT) from random starts, in stored batches, with a note about each batch.

    The start points of batch k depend on the seed and k only.

    Raises:
        InputError: fewer than one start.
        OutputError: a batch cannot be stored.
    """
    if starts < 1:
        raise InputError(f"starts must be at least 1, got {starts}")
    solver = solver or IpoptSettings()
    ready = solver.prepare(problem, starts)
    identity = {**identify_problem(problem), "seed": seed, "settings": repr(solver)}
    ends: list[StartEnd] = []
    for k, first in enumerate(range(0, starts, BATCH)):
        count = min(BATCH, starts - first)
        inputs = {**identity, "batch": k, "count": count}
        batch = partial(_run_batch, problem, ready, seed, k, count)
        ends += work.compute(tuple[StartEnd, ...], f"starts-{first}", inputs, batch)
        work.progress(f"{len(ends)} starts")
    return ends


def _run_batch(problem: GaitProblem, solver: Solver, seed: int, batch: int, count: int) -> tuple[StartEnd, ...]:
    rng = np.random.default_rng([seed, batch])
    outcomes = [solver.run(problem, problem.start_point(rng)) for _ in range(count)]
    return tuple(
        StartEnd(x=tuple(end.x.tolist()), objective=end.objective, feasible=bool(end.converged), status=end.status)
        for end in outcomes
    )


def cluster_ends(problem: GaitProblem, ends: Sequence[StartEnd]) -> list[LocalOptimum]:
    """Return the distinct optima among the feasible ends, best first."""
    feasible = sorted((end for end in ends if end.feasible), key=lambda end: problem.objective.sign * end.objective)

    def is_same(end: StartEnd, head: StartEnd) -> bool:
        near = abs(end.objective - head.objective) <= SAME_OBJECTIVE * abs(head.objective)
        return near and bool(np.max(np.abs(np.subtract(end.x, head.x)) / problem.scale) <= SAME_X)

    counts: dict[StartEnd, int] = {}  # by the best end of each optimum
    for end in feasible:
        best = next((head for head in counts if is_same(end, head)), end)
        counts[best] = counts.get(best, 0) + 1
    return [
        LocalOptimum(objective=head.objective, count=count, share=count / len(feasible), x=head.x)
        for head, count in counts.items()
    ]


def bound_missed(starts: int) -> float:
    """Return the largest share of starts, with 95 % confidence, that an optimum attracts if no start has reached it."""
    return -math.expm1(math.log(1 - CONFIDENCE) / starts)
