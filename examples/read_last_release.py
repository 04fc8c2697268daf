"""Read a study of the last release: write its records, of schema 3 or 4, as records of this one.

Points are judged again when the new records are read; the report excludes those whose problem has changed.

    python examples/read_last_release.py old new
    nlp-gait report new
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from compare.study.record import SCHEMA, RunRecord, parse_record
from compare.study.record_files import write_records
from compare.study.task import Inputs, ProblemSpec
from nlp_gait.backends.identity import identify_problem
from nlp_gait.decoding import decode


def convert(old: dict[str, Any]) -> RunRecord:
    """Return the record; raises ValueError for anything else, and GaitError if its problem is gone."""
    inputs, origin = old.pop("definition"), old["origin"]
    problem = inputs["problem"]
    problem["options"].pop("load_degree", None)  # acted on planned loads alone, which are gone
    spec = ProblemSpec(name=problem["name"], options=problem["options"], values=problem["parameters"])
    inputs["problem"] = identify_problem(spec.load())
    inputs["code"] = origin.pop("code_sha256") if origin else ""
    inputs["imported"] = (inputs.get("imported") or {}).get("sha256", "")
    if polishes := inputs.pop("polishes", None):
        inputs |= {**polishes, "polish": True}
        inputs.pop("key", None)
    inputs["stop"] = {key: value for key, value in inputs.get("stop", {}).items() if value is not None}
    del old["seed"]
    complete = asdict(decode(Inputs, inputs))  # with the defaults, which records of this release contain
    return parse_record({**old, "inputs": complete, "schema": SCHEMA})


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    paths = sorted((source / "records").glob("*/*.json"))
    write_records([convert(json.loads(path.read_text(encoding="utf-8"))) for path in paths], target)
