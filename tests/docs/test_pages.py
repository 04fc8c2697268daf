"""Generated pages: none is missing, each says what its object is; formulas are numbered once; the check of a site; citations."""

import importlib
import re
import tomllib
from pathlib import Path
from pkgutil import resolve_name

import pytest
import yaml

import nlp_gait
from compare.cli import PANELS, load_command
from compare.study.run import list_solvers
from docs.check import faults_of
from docs.pages import algorithms, api, commands, playground, problems
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.formulation import list_problems, load

ROOT = Path(__file__).parents[2]
OWN = ("nlp_gait", "metaheuristics", "compare")


def test_no_public_name_is_missing_from_the_reference(tmp_path: Path) -> None:
    """Whatever a front door lists stands in the reference under its own heading, once described and elsewhere linked."""
    api.write(tmp_path)
    for door in (*OWN, *(f"{package}.{room}" for package, room in doors())):
        page = (tmp_path / "api" / f"{door}.rst").read_text(encoding="utf-8")
        for name in importlib.import_module(door).__all__:
            assert f"\n{name}\n{'-' * len(name)}\n" in page, f"{door}.{name}"
    pages = "\n".join(path.read_text(encoding="utf-8") for path in (tmp_path / "api").glob("*.rst"))
    described = re.findall(r"^\.\. (?:auto\w+|py:data):: (\S+)", pages, re.MULTILINE)
    objects = [(name.rpartition(".")[2], id(resolve_name(name))) for name in described]
    assert len(objects) == len(set(objects)) > 80  # else Sphinx finds two targets for one name


def doors() -> list[tuple[str, str]]:
    """Packages and rooms whose ``__init__`` lists what they offer."""
    found = []
    for package in OWN:
        for path in sorted((ROOT / package).glob("*/__init__.py")):
            if "__all__" in path.read_text(encoding="utf-8"):
                found.append((package, path.parent.name))
    return found


def test_a_page_for_each_command_with_every_option(tmp_path: Path) -> None:
    commands.write(tmp_path)
    for name in (name for listed in PANELS.values() for name in listed):
        page = (tmp_path / "commands" / f"{name}.md").read_text(encoding="utf-8")
        assert page.startswith(f"# nlp-gait {name}\n")
        for parameter in load_command(name).params:
            flags = parameter.opts if parameter.param_type_name == "option" else [parameter.metavar.strip("[].")]
            assert all(flag in page for flag in flags), (name, flags)
    compare = (tmp_path / "commands" / "compare.md").read_text(encoding="utf-8")
    assert "| `--runs` `INTEGER` | Runs of each search algorithm. Default: `11`. |" in compare
    assert "nlp-gait compare nao-ssp --algorithms pso --starts 0 --runs 1" in compare


def test_every_algorithm_and_solver_is_described(tmp_path: Path) -> None:
    algorithms.write(tmp_path)
    page = (tmp_path / "algorithms.md").read_text(encoding="utf-8")
    assert all(f"\n### {name}\n" in page for name in list_solvers())


def test_every_problem_has_a_page() -> None:
    assert set(problems.names()) == {name for name in list_problems() if name != "gaitbench"}
    assert set(problems.difficulties()) <= set(problems.names())


def test_the_sizes_of_the_nlps_are_those_of_today() -> None:
    rows = {line.split("`")[1]: line.split(" | ") for line in problems.nlp_sizes().splitlines() if "`" in line}
    assert set(rows) == set(problems.names())
    for name in ("walk12", "nao-dsp"):
        model = build_nlp(load(name))
        assert rows[name][1:4] == [str(model.nlp["x"].numel()), str(model.lifted), str(model.nlp["g"].numel())]


def test_the_page_of_a_problem_is_made_from_the_problem() -> None:
    problem, found = load("nao-dsp"), problems.difficulties()["nao-dsp"]
    page = problems.problem_page(problem, found)
    assert "gaits/nao-dsp.html" in page
    assert all(f"| `{v.name}` | {v.lower:g} | {v.upper:g} |" in page for v in problem.variables)
    assert all(f"`{q.name}`" in page for q in problem.own_parameters if not q.name.endswith((".lower", ".upper")))
    assert found.best is not None and f"**{found.best.objective:.8g} W**" in page
    assert f"| pso | {found.solvers['pso'].runs} |" in page and " µs, a run of a search" in page
    assert all(f"`{a.name}`" in page for a in found.best.active_constraints[: problems.SHOWN])


def test_what_was_measured_of_another_version_is_refused(tmp_path: Path) -> None:
    found = problems.difficulties()["walk12"]
    assert found.best is not None
    wrong = problems.Difficulty(**{**vars(found), "best": type(found.best)(**{**vars(found.best), "objective": 1.5})})
    with pytest.raises(ValueError, match="the problem has changed"):
        problems.best_section(load("walk12"), wrong)
    assert "Not measured yet" in problems.best_section(load("walk12"), None)


def test_the_check_of_a_site_finds_what_is_wrong(tmp_path: Path) -> None:
    text = "words " * 50
    (tmp_path / "b.html").write_text(f"<h1 id='top'>{text}</h1><a href='a.html'>a</a>")
    (tmp_path / "a.html").write_text(
        f"<p>{text}</p><a href='b.html#top'>good</a><a href='b.html#gone'>bad</a><a href='c.html'>bad</a>"
        "<script src='https://example.org/x.js'></script><img src='none.png'>"
    )
    (tmp_path / "empty.html").write_text("<script>" + text + "</script>")
    faults = faults_of(tmp_path)
    assert faults == [
        "a.html loads https://example.org/x.js",
        "a.html loads none.png, which is not there",
        "a.html links to b.html#gone, which has no such anchor",
        "a.html links to c.html, which is not there",
        "empty.html has no content",
    ]


def test_without_a_compiler_the_page_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One sentence says so, in the build and on the page that leads there; an older page is removed."""
    monkeypatch.setattr(playground, "has_compiler", lambda: False)
    old = tmp_path / playground.FOLDER / playground.PAGE
    old.parent.mkdir()
    old.touch()
    playground.write_playground(tmp_path)
    playground.write(tmp_path)
    assert not old.exists()
    sentence = "WebAssembly needs the package ziglang: pip install ziglang"
    assert capsys.readouterr().out == f"the playground is left out: {sentence}\n"
    page = (tmp_path / "playground" / "index.md").read_text(encoding="utf-8")
    assert f"This build is without the playground: {sentence}." in page and "Open the playground" not in page


@pytest.mark.parametrize(
    "path", sorted((*ROOT.glob("docs/*.md"), *ROOT.glob("docs/model/*.md"), *ROOT.glob("*.md"))), ids=str
)
def test_commands_of_pages_exist_with_their_options(path: Path) -> None:
    """In blocks of a shell and in backticks; the changelog names what is gone."""
    known = {name for names in PANELS.values() for name in names}
    text = path.read_text(encoding="utf-8") if path.name not in ("CHANGELOG.md", "changelog.md") else ""
    for line in re.findall(r"nlp-gait ((?:[a-z]+)\b[^\n`#|;&]*)", re.sub(r"'[^'\n]*'", "", text)):
        name, *words = line.split()
        if name not in known:
            assert not words or not any(word.startswith("--") for word in words), line
            continue
        options = {flag for p in load_command(name).params for flag in (*p.opts, *p.secondary_opts)} | {
            "--help",
            "--json",
        }
        assert {word.rstrip(".,)") for word in words if word.startswith("--")} <= options, line


CFF = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_the_citation_file_is_valid_and_of_this_version() -> None:
    """By the schema of CFF 1.2.0."""
    assert CFF.keys() >= {"authors", "cff-version", "message", "title"} and CFF["cff-version"] == "1.2.0"
    assert re.fullmatch(r"\d{4}-\d{2}-\d{2}", CFF["date-released"])
    for reference in CFF["references"]:
        assert reference.keys() >= {"authors", "title", "type"} and reference["type"] in ("article", "report")
        assert all(author.keys() <= {"family-names", "given-names"} for author in reference["authors"])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert CFF["version"] == nlp_gait.__version__ and CFF["license"] == project["project"]["license"]


PAGES = sorted((ROOT / "docs" / "model").glob("*.md"))
EQUATION = re.compile(r"```\{math\}\n:label: ([A-Z]\.[0-9]+)\n\n(.*?)\n```", re.DOTALL)
FORMULAS = {label: tex for path in PAGES for label, tex in EQUATION.findall(path.read_text(encoding="utf-8"))}


def test_there_are_many_and_none_is_numbered_twice() -> None:
    found = [label for path in PAGES for label, _ in EQUATION.findall(path.read_text(encoding="utf-8"))]
    assert len(found) == len(set(found)) >= 80 and len(PAGES) >= 9
    letters = {
        path.name: {label[0] for label, _ in EQUATION.findall(path.read_text(encoding="utf-8"))} for path in PAGES
    }
    assert all(len(own) <= 1 for own in letters.values())  # a page has one letter
    for letter in {label[0] for label in found}:
        numbers = [int(label[2:]) for label in found if label[0] == letter]
        assert numbers == list(range(1, len(numbers) + 1))  # in the order of the page


def test_references_lead_to_equations() -> None:
    """On the pages by their role, in docstrings by their number."""
    referred = {label for path in PAGES for label in re.findall(r"\{eq\}`([^`]*)`", path.read_text(encoding="utf-8"))}
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "nlp_gait").rglob("*.py"))
    in_code = set(re.findall(r"\(([BCDKLPRSTWM]\.[0-9]+)\)", code))
    assert referred and len(in_code) >= 20
    assert referred | in_code <= FORMULAS.keys()
