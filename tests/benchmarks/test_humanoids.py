"""The table of humanoids, from stored files of robots that finished, were refused, or were not run."""

import json
from pathlib import Path

import pytest

pytest.importorskip("mujoco")

from benchmarks.humanoids import find_plan, list_names, run, tabulate_others, tabulate_walks  # noqa: E402

PLAN = {"mass_kg": 5.3, "energy_J_per_m": 20.34, "speed_m_s": 0.086, "margins_m": [0.023, 0.009]}
WALK = {"none": {"walked": 0.997, "fell_at_s": None}, "balance": {"walked": None, "fell_at_s": 2.55}}
PUSH = {"none": {"forward": 1.44, "backward": 2.17, "left": 1.7, "right": 1.0}}


def write(folder: Path, name: str, **row: object) -> None:
    (folder / find_plan(folder, name).name).write_text(json.dumps({"name": name, **row}), encoding="utf-8")


def test_rows_say_what_was_run_and_what_was_not(tmp_path: Path) -> None:
    write(tmp_path, "nao-v4", plan=PLAN)
    write(tmp_path, "nao-v5", plan=PLAN, walk=WALK, push=PUSH)
    write(tmp_path, "nao-v6", plan={"infeasible": ["step 1: knee exceeds its limit by 1 rad (row); plan less"]})
    write(tmp_path, "mjlab:g1", plan={"refused": "robot 'g1': its knees bend in opposite directions; correct one"})
    assert list(tabulate_walks([tmp_path]))[1:] == [
        "| `nao-v4` | 5.3 | 20.3 | 0.09 | 23, 9 | not run | not run | not run | not run |",
        "| `nao-v5` | 5.3 | 20.3 | 0.09 | 23, 9 | 99.7% | falls at 2.5 s | 1.4, 2.2, 1.7, 1 | falls unpushed |",
    ]
    others = dict(line.strip("| ").split(" | ") for line in list(tabulate_others([tmp_path]))[1:])
    assert others["`nao-v6`"] == "no feasible walk: step 1: knee exceeds its limit by 1 rad"
    assert others["`mjlab:g1`"] == "refused: its knees bend in opposite directions"
    assert others["`armar:armar4`"] == "not run (time)" and len(others) == len(list_names()) - 2


def test_a_finished_robot_is_not_run_again_and_a_missing_package_is_recorded(tmp_path: Path) -> None:
    write(tmp_path, "nao-v5", plan={"infeasible": ["kept"]})
    run(["nao-v5", "no-such-package:robot"], tmp_path, [0.0, 0.0])
    rows = [
        json.loads((tmp_path / find_plan(tmp_path, name).name).read_text())
        for name in ("nao-v5", "no-such-package:robot")
    ]
    assert rows[0]["plan"] == {"infeasible": ["kept"]} and "is not installed" in rows[1]["plan"]["not run"]
