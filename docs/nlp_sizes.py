"""Sizes of all NLPs, for the documentation: ``python -m docs.nlp_sizes`` writes docs/nlp_sizes.json."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import nlp_gait
from nlp_gait.backends.derivatives.assembly import make_nlp_plan
from nlp_gait.backends.derivatives.structure import split_nlp
from nlp_gait.backends.nlp import build_nlp

FILE = Path(__file__).with_suffix(".json")


def measure(name: str) -> dict[str, int]:
    """Sizes of the NLP that solvers receive, with the default options."""
    problem = nlp_gait.load(name)
    model = build_nlp(problem)
    found = make_nlp_plan(split_nlp(model.nlp))
    bounds = model.bounds(problem)
    return {
        "variables": found.jacobian.size2(),
        "lifted": model.lifted,
        "constraints": found.jacobian.size1(),
        "equations": int(np.sum(bounds["lbg"] == bounds["ubg"])),
        "jacobian": found.jacobian.nnz(),
        "hessian": found.hessian.nnz(),
    }


def main() -> None:
    """Measure and write."""
    sizes = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for name in set(nlp_gait.list_problems()) - {"gaitbench"}:  # which is nao-ssp by default
        sizes[name] = measure(name)
        print(name, sizes[name], flush=True)
        FILE.write_text(json.dumps(dict(sorted(sizes.items())), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
