"""Write the catalogue of instances in the documentation.

``python -m benchmarks.gaitbench.documents``
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nlp_gait import gaitbench
from nlp_gait.files import write_json

DOCS = Path(gaitbench.__file__).parents[2] / "docs"
SUITE = "GaitBench 1"


def main() -> None:
    """Write the catalogue."""
    write_json(DOCS / "gaitbench.json", make_catalogue())


def make_catalogue() -> dict[str, Any]:
    """Return the suite as plain data, with an entry for every instance.

    The keys of an entry follow the Optimisation Problem Library (OPL): objectives, dimension, types of
    variables, constraints, whether it is dynamic, noisy, multimodal or has several fidelities, reference and implementation.
    """
    return {
        "suite": SUITE,
        "package": "nlp-gait",
        "schema": 1,
        "problems": [make_entry(id) for id in gaitbench.list_instances()],
    }


def make_entry(id: str) -> dict[str, Any]:
    """Return the entry of an instance."""
    instance = gaitbench.load(id)
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
        "feasible_share": instance.facts.feasible_share,
        "dynamic": False,
        "noise": False,
        "multimodal": "several ends of IPOPT" if evidence.agreeing < evidence.starts else "one end of IPOPT",
        "multi_fidelity": False,
        "evaluation_us": instance.facts.evaluation_us,
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


if __name__ == "__main__":
    main()
