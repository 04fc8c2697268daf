"""All instances as one JSON catalogue, an entry each, with the details that libraries of problems collect."""

from __future__ import annotations

from typing import Any

from nlp_gait.gaitbench.definitions import names
from nlp_gait.gaitbench.instance import load

SUITE = "GaitBench 1"


def catalogue() -> dict[str, Any]:
    """Plain data: the suite, and an entry for every instance.

    The keys of an entry follow what the Optimisation Problem Library (OPL) asks of a problem: objectives, dimension, types of
    variables, constraints, whether it is dynamic, noisy, multimodal or has several fidelities, reference and implementation.
    """
    return {"suite": SUITE, "package": "nlp-gait", "schema": 1, "problems": [_entry(id) for id in names()]}


def _entry(id: str) -> dict[str, Any]:
    instance = load(id)
    definition, evidence = instance.definition, instance.evidence
    objective = instance.gait_problem.objective
    return {
        "id": id,
        "name": f"{SUITE}: {definition.what}",
        "kind": "single problem of a suite",
        "subsets": ["small", "full"] if definition.small else ["full"],
        "difficulty": definition.difficulty,
        "objectives": 1,
        "objective": {"name": objective.name, "unit": objective.unit, "negated": objective.sign < 0},
        "variables": {
            "dimension": len(instance.names),
            "type": "continuous",
            "names": list(instance.names),
            "units": list(instance.units),
            "lower": instance.lower.tolist(),
            "upper": instance.upper.tolist(),
        },
        "constraints": {"present": True, "inequalities": len(instance.row_names), "equations": 0},
        "feasible_share": instance.known.feasible_share,
        "dynamic": False,
        "noise": False,
        "multimodal": "several ends of IPOPT" if evidence.agreeing < evidence.starts else "one end of IPOPT",
        "multi_fidelity": False,
        "evaluation_us": instance.known.evaluation_us,
        "best_known": {
            "objective": instance.best_known,
            "x": instance.best_x.tolist(),
            "evidence": str(evidence),
            "ipopt_starts": evidence.starts,
            "ipopt_agreeing": evidence.agreeing,
            "cma_gap": evidence.cma_gap,
            "proven_gap": evidence.proven_gap,
        },
        "built_from": {
            "problem": definition.problem,
            "options": dict(definition.options),
            "parameters": dict(definition.values),
            "held": dict(definition.held),
        },
        "reference": definition.source,
        "implementation": f"nlp_gait.gaitbench.load({id!r})",
    }
