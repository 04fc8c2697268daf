"""Catalogue and table of instances in the documentation, from what is known.

``python -m benchmarks.gaitbench.documents``
"""

from __future__ import annotations

from pathlib import Path

from compare.bench.baseline import shipped
from nlp_gait import gaitbench
from nlp_gait.files import write_json, write_text

DOCS = Path(gaitbench.__file__).parents[2] / "docs"
MARKS = {
    "instances": ("<!-- instances -->", "<!-- end of instances -->"),
    "shipped": ("<!-- shipped -->", "<!-- end -->"),
}


def main() -> None:
    """Write both."""
    write_json(DOCS / "gaitbench.json", gaitbench.catalogue())
    page = DOCS / "gaitbench.md"
    text = page.read_text(encoding="utf-8")
    for content, (begin, end) in zip((instances_table(), shipped_sentence()), MARKS.values(), strict=True):
        head, _, rest = text.partition(begin)
        text = f"{head}{begin}\n{content}\n{end}{rest.partition(end)[2]}"
    write_text(page, text)


def instances_table() -> str:
    """A row for each instance."""
    rows = ["| id | what | n | rows | feasible | cost | best known | evidence |", "|---|---|--:|--:|--:|--:|--:|---|"]
    for id in gaitbench.names():
        instance = gaitbench.load(id)
        share, small = instance.known.feasible_share, instance.definition.small
        rows.append(
            f"| `{id}`{' *' if small else ''} | {instance.definition.what} | {len(instance.names)} | "
            f"{len(instance.row_names)} | {100 * share:.2g} % | {instance.known.evaluation_us:.2g} us | "
            f"{instance.best_known:.6g} | {instance.evidence} |"
        )
    return "\n".join([*rows, "", "An asterisk marks those of the subset `small`."])


def shipped_sentence() -> str:
    """Of which instances records are shipped."""
    there, everything = shipped(), gaitbench.names()
    if set(there) >= set(everything):
        return "Records of all instances are shipped."
    return (
        f"Shipped so far are the records of {len(there)} of the {len(everything)} instances: "
        + ", ".join(f"`{id}`" for id in everything if id in there)
        + "."
    )


if __name__ == "__main__":
    main()
