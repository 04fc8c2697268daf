"""User-defined problems by name; mistakes in them are reported when they are made, with the name of the row."""

import json
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import pytest
from casadi import MX

from compare.study.run import ProblemSpec, Run, make_inputs
from nlp_gait import compile_objective, load, solve, user_code
from nlp_gait.errors import GaitError, InputError, UnknownNameError, UserCodeError
from nlp_gait.formulation import (
    Assembly,
    Constraint,
    Grid,
    Objective,
    Parameter,
    SolverHints,
    Variable,
)
from nlp_gait.formulation.registry import check_mathematics
from nlp_gait.formulation.solution import load_result
from nlp_gait.user_code import read_source_files
from tests.backends.toys import corner, toy

EXAMPLE = Path(__file__).parents[2] / "examples" / "bring_your_own.py"
THREE = MX.sym("three", 3)
GOOD: dict[str, Any] = {"name": "knee", "unit": "m", "scale": 0.01, "value": MX.sym("v"), "lower": MX(0.0)}


def test_a_maker_in_a_file_is_loaded_with_its_options_and_solved() -> None:
    problem = load(f"{EXAMPLE}:two_link", intervals=10)
    assert problem.name == "two-link" and problem.load_name == f"{EXAMPLE}:two_link"
    assert problem.options == {"intervals": 10, "lift_m": 0.05}
    assert solve(problem, starts=2).converged
    with pytest.raises(UnknownNameError, match="did you mean 'intervals'"):
        load(f"{EXAMPLE}:two_link", interval=10)


def test_an_installed_packages_problem_has_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint(name="leg", value=f"{EXAMPLE}:two_link", group=user_code.GROUPS["problem"])
    monkeypatch.setattr(user_code, "entry_points", lambda group: EntryPoints([point]).select(group=group))
    find = user_code.find_entry_points.__wrapped__  # without its cache
    monkeypatch.setattr(user_code, "find_entry_points", find)
    assert load("leg").name == "two-link" and ProblemSpec(name="leg").title == "leg"
    with pytest.raises(UnknownNameError, match="did you mean 'leg'"):
        load("lag")


def test_a_study_takes_a_problem_itself() -> None:
    spec = ProblemSpec(name=toy(corner), values={"limit": 0.25})
    assert spec.load().value("limit") == 0.25 and spec.title == "toy"
    changed, usual = make_inputs([Run(problem=s, solver="pso") for s in (spec, ProblemSpec(name=toy(corner)))])
    assert changed.key != usual.key
    with pytest.raises(InputError, match="is already built; options are not allowed: intervals"):
        spec.with_options(intervals=3).load()


def test_a_result_file_runs_no_code_that_was_not_named(tmp_path: Path) -> None:
    file = tmp_path / "other.py"
    file.write_text("from nlp_gait.formulation import load\nleg = load('walk12')\n")
    walk = load("walk12")
    x = walk.by_name((walk.lower + walk.upper) / 2)
    (tmp_path / "best.json").write_text(json.dumps({"problem": "elsewhere/other.py:leg", "x": x}))
    with pytest.raises(InputError, match="needs your code 'elsewhere/other.py:leg', which runs only if you name it"):
        load_result(tmp_path / "best.json")
    load(f"{file}:leg")
    assert load_result(tmp_path / "best.json").problem.load_name == f"{file}:leg"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def leg(): return 3", "must make a GaitProblem, it made int"),
        ("leg = 3", "must be a GaitProblem or a function that makes one, got int"),
        ("def leg(*, steps): ...", "option steps needs a default"),
        ("import sys\nsys.exit(2)", "'.*:leg' fails at line 2, `sys.exit\\(2\\)`: SystemExit: 2"),
        (
            "import casadi as ca\ndef leg(): return ca.fmax(None, 'a')",
            "at line 2, .*CasADi does not take these arguments",
        ),
    ],
)
def test_messages_say_what_is_wrong_with_the_file(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(text)
    with pytest.raises(GaitError, match=message) as said:
        load(f"{tmp_path / 'own.py'}:leg")
    assert "\n" not in str(said.value)
    with pytest.raises(UserCodeError, match="cannot be read: No such file"):
        load(f"{tmp_path / 'none.py'}:leg")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"upper": "1"}, "'knee': upper must be a CasADi MX, got str '1'"),
        ({"value": None}, "'knee': value must be a CasADi MX, got NoneType"),
        ({"value": THREE}, "'knee': value has 3 rows and labels has 0; give one label per row"),
        ({"lower": None}, "'knee': lower, upper or both are required"),
        (
            {"value": THREE, "labels": ("a", "b", "c"), "lower": 0.5, "upper": MX([1.0, 0.0, 1.0])},
            "'knee': no number is between lower 0.5 and upper 0",
        ),
        ({"lower": float("inf"), "upper": float("inf")}, "'knee': no number is between lower inf and upper inf"),
    ],
)
def test_a_row_is_refused_by_name(change: dict[str, Any], message: str) -> None:
    Constraint(**GOOD)
    with pytest.raises(InputError, match=message):
        Constraint(**{**GOOD, **change})


def test_objectives_variables_and_parameters_are_refused_by_name() -> None:
    with pytest.raises(InputError, match="objective must be a scalar MX, got shape \\(3, 1\\)"):
        Assembly(objective=THREE, constraints=(), metrics={})
    with pytest.raises(InputError, match="metric 'power_W' must be a scalar MX, got float 1.0"):
        Assembly(objective=MX.sym("f"), constraints=(), metrics={"power_W": 1.0})  # type: ignore[dict-item]
    with pytest.raises(InputError, match="constraints must be Constraint, got int 3"):
        Assembly(objective=MX.sym("f"), constraints=(3,), metrics={})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="variable 'lift': lower must be below upper, got 1.0 and 1.0"):
        Variable(name="lift", unit="m", lower=1.0, upper=1.0, description="")
    with pytest.raises(InputError, match="parameter 'mass': default must be a finite number, got None"):
        Parameter(name="mass", unit="kg", default=None, description="")  # type: ignore[arg-type]
    x = Variable(name="x", unit="m", lower=0.0, upper=1.0, description="")
    with pytest.raises(InputError, match="are named x, x.lower, x.upper; rename"):
        replace(toy(corner), variables=(x, x))


@pytest.mark.parametrize("spelling", ["minimize", "maximize", "minimise", "maximise"])
def test_both_spellings_of_a_sense_mean_the_same(spelling: Any) -> None:
    objective = Objective(name="f", unit="1", sense=spelling)
    assert objective.sense == spelling.replace("z", "s")
    assert objective.sign == (1.0 if spelling.startswith("min") else -1.0)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda value: Objective(name="f", unit="1", sense=value), "objective 'f': sense"),
        (lambda value: Grid(intervals=2, refined_by=value), "refined_by"),
        (lambda value: SolverHints(hessian=value), "hessian"),
    ],
)
@pytest.mark.parametrize("value", ["Minimise", 1])
def test_a_value_that_a_data_class_does_not_allow_is_refused_when_it_is_made(make: Any, name: str, value: Any) -> None:
    with pytest.raises(InputError, match=f"{name} must be one of .*, got {value!r}"):
        make(value)


def test_inverted_bounds_of_a_row_are_one_sentence_everywhere() -> None:
    problem = toy(lambda x, y, limit, ops: (x, (replace(row(x, lower=limit), upper=MX(0.0)),)), limit=-1.0)
    inverted = problem.with_values(limit=1.0)
    assert solve(problem).converged and compile_objective(problem).names == ("x", "y")
    for use in (solve, compile_objective):
        with pytest.raises(InputError, match="bounds of constraint knee are inverted, lower 1 above upper 0, at these"):
            use(inverted)


@pytest.mark.parametrize(
    ("mathematics", "message"),
    [
        (lambda x, y, p, ops: (x, (row(x, lower=y),)), "constraint 'knee': lower must depend on parameters only"),
        (lambda x, y, p, ops: (x, (row(x), row(y))), "duplicated rows: knee"),
        (lambda x, y, p, ops: (x + MX.sym("mass"), ()), "objective contains 'mass', which is neither a variable nor"),
        (
            lambda x, y, p, ops: (x, (replace(row(x), lower=MX(float("nan"))),)),
            "constraint 'knee': lower is NaN; give a number, or leave it out for no bound",
        ),
    ],
)
def test_mathematics_that_backends_cannot_use_is_refused(mathematics: Any, message: str) -> None:
    check_mathematics(toy(corner))
    with pytest.raises(InputError, match=message):
        check_mathematics(toy(mathematics))


def row(value: MX, lower: MX | None = None) -> Constraint:
    return Constraint(name="knee", unit="m", scale=1.0, value=value, lower=MX(0.0) if lower is None else lower)


def test_a_source_is_the_file_and_the_files_next_to_it_that_it_imports(tmp_path: Path) -> None:
    text = "import helper\nfrom package import part\ndef leg(): return 1\n"
    files = {"own.py": text, "helper.py": "import other\n", "other.py": "X = 1\n", "package/part.py": "Y = 1\n"}
    (tmp_path / "package").mkdir()

    def hash_with(**changes: str) -> str:
        for name, content in {**files, **changes}.items():
            (tmp_path / name).write_text(content)
        return read_source_files(f"{tmp_path / 'own.py'}:leg", "problem").digest

    before = hash_with()
    assert hash_with(**{"unused.py": "Z = 1\n"}) == before == hash_with()
    changed = {hash_with(**{name: f"{content}edited = True\n"}) for name, content in files.items()}
    assert len(changed) == 4 and before not in changed
    assert hash_with(**{"own.py": f"{text}def"}) not in changed  # also where it cannot be parsed


def test_a_source_of_five_megabytes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_bytes(b"#" * 5 * 2**20)
    with pytest.raises(UserCodeError, match="it has more than 4194304 bytes"):
        read_source_files(f"{path}:leg", "problem")
