"""The dependency rule: later layers import earlier ones only, by statement or by name; no cycles; importing stays cheap."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# A layer imports from itself and from earlier layers only.
LAYERS = (
    "nlp_gait.interrupts",
    "nlp_gait.errors",
    "nlp_gait.providers",
    "nlp_gait.processes",
    "nlp_gait.files",
    "nlp_gait.columns",
    "nlp_gait.decoding",
    "nlp_gait.user_code",
    "nlp_gait.robots",
    "nlp_gait.symbolic",
    "nlp_gait.formulation",
    "nlp_gait.gaits",
    "nlp_gait.limits",
    "nlp_gait.backends",
    "nlp_gait.proofs",
    "nlp_gait.simulation",
    "nlp_gait.export",
    "nlp_gait.gaitbench",
    "metaheuristics",
    "compare.judge",
    "compare.study",
    "compare.analysis",
    "compare.drawing",
    "compare.report",
    "compare.bench",
    "compare.questions",
    "compare.papers",
    "compare.cli",
)
# Imports of a later layer within a method: what a solution shows is made by the packages that draw.
SHOWN = {
    "nlp_gait.formulation.solution": (
        "compare.drawing.gait_figure.plot_gait",
        "compare.report.interactive.animate_gait",
    )
}
TABLES = ("nlp_gait.providers",)  # of problems and limits, which name the places of their definitions
# Entry points of packages, which may import every layer; no layer up to ``export`` imports them.
ENTRIES = ("nlp_gait", "nlp_gait.__main__", "compare", "compare.__main__")
PACKAGES = ("nlp_gait", "metaheuristics", "compare")
PLACE = re.compile(rf"({'|'.join(PACKAGES)})(\.\w+)+(:\w+)?")
FAMILIES = [f"nlp_gait/gaits/{family}" for family in ("humanoid", "nao", "stairs", "walk12")]
# What a package must not import: families of problems each other, and searches neither formulas nor gaits.
APART = {family: [other.replace("/", ".") for other in FAMILIES if other != family] for family in FAMILIES}
APART |= {"metaheuristics": ["casadi", "nlp_gait", "compare"]}


def modules(package: str) -> list[str]:
    """Dotted names of all modules of a package."""
    paths = sorted((ROOT / package).rglob("*.py"))
    return [".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for p in paths]


@cache
def read_nodes(path: Path) -> tuple[ast.Import | ast.ImportFrom | ast.Constant, ...]:
    """What the tests look at in a file: imports and texts that name a module."""
    return tuple(
        node
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        or (isinstance(node, ast.Constant) and isinstance(node.value, str) and PLACE.fullmatch(node.value))
    )


def nodes_of(module: str) -> tuple[ast.Import | ast.ImportFrom | ast.Constant, ...]:
    path = ROOT.joinpath(*module.split("."))
    return read_nodes(path / "__init__.py" if path.is_dir() else path.with_suffix(".py"))


def imports(module: str) -> Iterator[str]:
    """Dotted names that a module imports anywhere in its text, relative ones resolved."""
    is_package = ROOT.joinpath(*module.split(".")).is_dir()
    for node in nodes_of(module):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = module.split(".")[: len(module.split(".")) - node.level + is_package] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def named_modules(module: str) -> Iterator[str]:
    """What a module names in texts as ``"package.module"`` or ``"package.module:object"``."""
    return (str(node.value).replace(":", ".") for node in nodes_of(module) if isinstance(node, ast.Constant))


def within(name: str, *packages: str) -> bool:
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def layer(name: str) -> int | None:
    """Position of a dotted name among the layers; None for a name of an entry."""
    return next((position for position, package in enumerate(LAYERS) if within(name, package)), None)


ALL = [m for package in PACKAGES for m in modules(package)]
LAYERED = set(ALL) - set(ENTRIES)


def wrong_imports(module: str) -> Iterator[str]:
    own = layer(module)
    if own is None:
        if module not in ENTRIES:
            yield "is in no layer"
        return
    texts = () if module in TABLES else named_modules(module)
    named = (name for name in texts if {name, name.rpartition(".")[0]} & LAYERED)
    for name in {*imports(module), *named}.difference(SHOWN.get(module, ())):
        if within(name, *PACKAGES):
            imported = layer(name)
            if imported is None:  # an entry of packages that come before this one
                if own <= LAYERS.index("nlp_gait.export"):
                    yield f"imports {name} from an entry"
                if within(name, "compare"):
                    yield f"imports {name} from its own entry"
            elif imported > own:
                yield f"imports {name} from a later layer"


def test_a_layer_imports_and_names_earlier_layers_only() -> None:
    assert not {module: wrong for module in ALL if (wrong := list(wrong_imports(module)))}


def test_files_do_not_import_each_other_in_a_circle() -> None:
    known = set(ALL)
    graph = {
        m: {
            next((n for n in (i, i.rpartition(".")[0]) if n in known), m)
            for i in {*imports(m)}.difference(SHOWN.get(m, ()))
        }
        - {m}
        for m in ALL
    }
    packages = {m for m in ALL if ROOT.joinpath(*m.split(".")).is_dir()}  # an ``__init__`` collects names of its files
    TopologicalSorter({m: targets - packages for m, targets in graph.items() if m not in packages}).prepare()  # raises


@pytest.mark.parametrize("package", APART)
def test_families_of_problems_and_searches_stand_alone(package: str) -> None:
    for module in modules(package):
        bad = [name for name in (*imports(module), *named_modules(module)) if within(name, *APART[package])]
        assert not bad, f"{module} imports {bad}"


@pytest.mark.parametrize(
    ("statement", "unwanted"),
    [
        ("import nlp_gait", "scipy.optimize matplotlib.pyplot metaheuristics compare"),
        ("import metaheuristics", "casadi nlp_gait matplotlib scipy cma pymoo"),
        ("import nlp_gait.gaitbench as suite; suite.list_instances()", "scipy.optimize matplotlib pymoo ioh cma"),
        ("from compare.cli.list import _list_all; _list_all()", "numpy casadi"),
    ],
)
def test_importing_costs_only_what_is_needed(statement: str, unwanted: str) -> None:
    program = f"import sys; {statement}; print(*sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    loaded = set(done.stdout.splitlines()[-1].split())
    assert statement.split()[1].rstrip(";") in loaded
    assert not loaded & set(unwanted.split())


# Modules that write without the functions of nlp_gait.files, into a temporary file of theirs or where nothing is kept.
ALLOWED = (
    "files processes backends/kernel/compiler export/formats proofs/branch_and_bound study/pack "
    "drawing/figures drawing/notebook_figure"
)
WRITING = re.compile(
    r"\.(write_text|write_bytes|savefig|savez|savez_compressed|rename|mkdir|touch)\("
    r"|\w\.replace\([^,()=]+\)"  # of a path; texts take two arguments
    r"|\bopen\([^)\n]*[\"'][wax]"
)


def test_every_writer_goes_through_one_module() -> None:
    modules = [
        (ROOT / name, path)
        for name in ("nlp_gait", "metaheuristics", "compare")
        for path in (ROOT / name).rglob("*.py")
    ]
    writers = {
        path.relative_to(root).as_posix()[:-3] for root, path in modules if WRITING.search(path.read_text("utf-8"))
    }
    assert writers <= set(ALLOWED.split())
