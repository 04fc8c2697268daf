"""How certain it is that the best known optimum is the global one: what is proven, and what is only supported."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

import metaheuristics
from compare.analysis.units import with_unit
from compare.questions.certainty.clusters import LocalOptimum, Unseen, cluster, unseen
from compare.questions.certainty.multistart import multistart
from compare.study.store import Store
from compare.study.task import describe_problem
from nlp_gait.backends.identity import fingerprint, hash_json
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import replace_nan
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.proofs.bounds import has_power_form
from nlp_gait.proofs.branch_and_bound import Certificate, certify
from nlp_gait.proofs.certificate import hash_code, make_certificate_file

# Branch and bound is for this many variables at most, for its work grows exponentially with them; NAO's phases have bounds of
# their own, narrow enough for nine.
MOST_CERTIFIED = 4


@dataclass(frozen=True, kw_only=True)
class LongSearch:
    """One long run of CMA-ES with restarts, which shares nothing with IPOPT but the exact functions.

    Attributes:
        objective: best feasible one, in the problem's sense; None if there was none.
        evaluations: used.
        gap: by how much it is worse than the best optimum, relative; negative if it is better.
    """

    objective: float | None
    evaluations: int
    gap: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Certainty:
    """Evidence that the best known optimum is the global one.

    Attributes:
        problem: with its parameter values.
        starts: of IPOPT.
        statuses: number of starts by how they ended.
        optima: distinct local optima, best first.
        unseen: what the counts say about others.
        search: None if it was not asked for.
        certificate: None if it was not asked for or there are too many variables.
    """

    problem: GaitProblem
    starts: int
    statuses: dict[str, int]
    optima: tuple[LocalOptimum, ...]
    unseen: Unseen
    search: LongSearch | None
    certificate: Certificate | None

    @property
    def proven(self) -> str:
        """What is proven, in one sentence."""
        c = self.certificate
        if c is None:
            return "nothing: branch and bound is for problems of at most four variables and for NAO's phases"
        if not math.isfinite(c.bound):
            return f"nothing: the time limit came before a finite bound, after {c.boxes:,} boxes"
        unit = self.problem.objective.unit
        bound, best = (with_unit(value, unit, ".6g") for value in (c.bound, c.objective))
        word = "no feasible x exceeds" if self.problem.objective.sign < 0 else "no feasible x falls below"
        return (
            f"{word} {bound}, {100 * c.gap:.3g} % from the best known {best}; "
            + ("the tolerance was reached" if c.closed else "the time limit came before the tolerance")
            + "; bounds rounded outward, libm's functions taken to be within four units in the last place"
        )

    @property
    def certificate_json(self) -> dict[str, Any] | None:
        """The certificate as a file that can be checked, where the proof is closed."""
        c = self.certificate
        return make_certificate_file(self.problem, c).to_json() if c is not None and c.closed else None

    @property
    def supported(self) -> str:
        """What is only supported, in one sentence."""
        best = self.optima[0]
        text = (
            f"{best.count} of {sum(o.count for o in self.optima)} converged starts end in the best of {len(self.optima)} "
            f"distinct optima; with 95 % confidence no unseen one attracts more than "
            f"{100 * self.unseen.largest_missed:.2g} % of starts"
        )
        if self.search is not None and self.search.gap is not None:
            text += (
                f"; CMA-ES ends {100 * self.search.gap:+.2g} % from it after {self.search.evaluations:,} evaluations"
            )
        return text

    def to_json(self) -> dict[str, Any]:
        """Plain data; the ends of the starts stay in their files."""
        certificate = None if self.certificate is None else {**asdict(self.certificate), "gap": self.certificate.gap}
        return {
            **describe_problem(self.problem),
            "starts": self.starts,
            "statuses": self.statuses,
            "optima": [asdict(optimum) for optimum in self.optima],
            "unseen": asdict(self.unseen),
            "search": None if self.search is None else asdict(self.search),
            "certificate": certificate,
            "proven": self.proven,
            "supported": self.supported,
        }


def certainty(
    problem: GaitProblem,
    store: Store,
    *,
    starts: int,
    evaluations: int,
    tolerance: float = 0.01,
    time_limit_s: float = 1800.0,
    seed: int = 0,
    progress: Progress = ignore_progress,
) -> Certainty:
    """Evidence by many starts, a long search and, for few variables, branch and bound; each result is stored.

    Args:
        problem: with its current parameter values.
        store: of finished results.
        starts: of IPOPT.
        evaluations: of CMA-ES; 0 for none.
        tolerance: relative, of the certificate.
        time_limit_s: of the certificate [s]; 0 for none.
        seed: of starts and search.
        progress: told each step, and how far it is.

    Raises:
        InputError: no start converged, or tolerance or time limit are not allowed.
        SearchError: CMA-ES is asked for and not installed.
        CompilerError: branch and bound is asked for and there is no compiler.
    """
    # Checked before the starts, which take long.
    if not (0.0 < tolerance < math.inf and 0.0 <= time_limit_s < math.inf):
        raise InputError(
            f"tolerance must be positive and finite, the time limit finite and >= 0 s; got {tolerance}, {time_limit_s} s"
        )
    if evaluations:
        metaheuristics.algorithm("cma")
    ends = multistart(problem, store, starts=starts, seed=seed, progress=progress)
    optima = cluster(problem, ends)
    if not optima:
        raise InputError(f"none of {starts} starts of {problem.name} converged to a feasible point; try more starts")
    best = optima[0]
    compute = partial(store.compute, progress=progress)
    identity = {**fingerprint(problem), "best": list(best.x)}

    def searched() -> dict[str, Any]:
        objective = compile_objective(problem)
        result = metaheuristics.minimize(objective, metaheuristics.algorithm("cma"), evaluations=evaluations, seed=seed)
        feasible = result.violation <= FEASIBILITY_TOLERANCE
        value = problem.objective.sign * result.objective if feasible else None
        gap = None if value is None else problem.objective.sign * (value - best.objective) / abs(best.objective)
        return asdict(LongSearch(objective=value, evaluations=result.evaluations, gap=gap))

    def proven() -> dict[str, Any]:
        x = np.array(best.x)
        name = f"proof-{hash_json({**identity, 'tolerance': tolerance})[:12]}.npz"
        checkpoint = None if store.folder is None else store.folder / name
        limits = {"tolerance": tolerance, "time_limit_s": time_limit_s}
        found = certify(problem, x, **limits, progress=progress, checkpoint=checkpoint)
        return dict(replace_nan(asdict(found)))

    search = certificate = None
    if evaluations:
        inputs = {**identity, "evaluations": evaluations, "seed": seed}
        search = decode(LongSearch, compute("cma", inputs, searched))
    if time_limit_s and (len(problem.names) <= MOST_CERTIFIED or has_power_form(problem)):
        limits = {"tolerance": tolerance, "time_limit_s": time_limit_s}
        inputs = {**identity, **limits, "proof_code_sha256": hash_code(problem)}
        certificate = decode(Certificate, compute("certificate", inputs, proven))
    return Certainty(
        problem=problem,
        starts=starts,
        statuses=dict(Counter(ends.status)),
        optima=tuple(optima),
        unseen=unseen(optima),
        search=search,
        certificate=certificate,
    )
