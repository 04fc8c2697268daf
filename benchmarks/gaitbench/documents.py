"""Write the catalogue and the table of instances in the documentation.

``python -m benchmarks.gaitbench.documents``
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.bench.baseline import list_baselines
from nlp_gait import gaitbench
from nlp_gait.files import write_json, write_text

DOCS = Path(gaitbench.__file__).parents[2] / "docs"
SUITE = "GaitBench 1"
MARKS = {
    "instances": ("<!-- instances -->", "<!-- end of instances -->"),
    "shipped": ("<!-- shipped -->", "<!-- end -->"),
}


def main() -> None:
    """Write the catalogue and the page."""
    write_json(DOCS / "gaitbench.json", make_catalogue())
    page = DOCS / "gaitbench.md"
    text = page.read_text(encoding="utf-8")
    for content, (begin, end) in zip((format_instances(), describe_shipped()), MARKS.values(), strict=True):
        head, _, rest = text.partition(begin)
        text = f"{head}{begin}\n{content}\n{end}{rest.partition(end)[2]}"
    write_text(page, text)


def format_instances() -> str:
    """Return a table with a row for each instance."""
    rows = [
        "| id | what | n | inequalities | feasible | cost | best known | evidence |",
        "|---|---|--:|--:|--:|--:|--:|---|",
    ]
    for id in gaitbench.list_instances():
        instance = gaitbench.load(id)
        share, small = instance.facts.feasible_share, instance.definition.small
        rows.append(
            f"| `{id}`{' *' if small else ''} | {instance.definition.what} | {len(instance.names)} | "
            f"{len(instance.row_names)} | {100 * share:.2g} % | {instance.facts.evaluation_us:.2g} us | "
            f"{instance.best_known:.6g} | {instance.evidence} |"
        )
    return "\n".join([*rows, "", "An asterisk marks those of the subset `small`."])


def describe_shipped() -> str:
    """Return a sentence on the instances whose records are shipped."""
    there, everything = list_baselines(), gaitbench.list_instances()
    if set(there) >= set(everything):
        return "Runs on all instances are shipped."
    return (
        f"Shipped so far are runs on {len(there)} of the {len(everything)} instances: "
        + ", ".join(f"`{id}`" for id in everything if id in there)
        + "."
    )


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
