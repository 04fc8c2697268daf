"""The dependency rule: imports go only from the later layers to the earlier ones, and importing stays cheap."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# A room imports from itself and from rooms before it only.
ROOMS = (
    "nlp_gait.interrupts",
    "nlp_gait.errors",
    "nlp_gait.processes",
    "nlp_gait.disk",
    "nlp_gait.files",
    "nlp_gait.columns",
    "nlp_gait.notebook",
    "nlp_gait.decoding",
    "nlp_gait.progress",
    "nlp_gait.references",
    "nlp_gait.robots",
    "nlp_gait.symbolic",
    "nlp_gait.formulation",
    "nlp_gait.gaits",
    "nlp_gait.backends",
    "nlp_gait.proofs",
    "nlp_gait.simulation",
    "nlp_gait.export",
    "nlp_gait.gaitbench",
    "metaheuristics",
    "compare.judge",
    "compare.study",
    "compare.analysis",
    "compare.logs",
    "compare.drawing",
    "compare.report",
    "compare.bench",
    "compare.questions",
    "compare.papers",
    "compare.cli",
)
# The front doors of packages: what stands in them is for users, and the command line stands above all.
DOORS = ("nlp_gait", "nlp_gait.__main__", "compare", "compare.__main__")
FAMILIES = ("humanoid", "nao", "stairs", "walk12")


def modules(package: str) -> list[str]:
    """Dotted names of all modules of a package."""
    paths = sorted((ROOT / package).rglob("*.py"))
    return [".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for p in paths]


def imports(module: str) -> Iterator[str]:
    """Dotted names that a module imports anywhere in its text, relative ones resolved."""
    path = ROOT.joinpath(*module.split("."))
    is_package = path.is_dir()
    text = (path / "__init__.py" if is_package else path.with_suffix(".py")).read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = module.split(".")[: len(module.split(".")) - node.level + is_package] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def within(name: str, *packages: str) -> bool:
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def room(name: str) -> int | None:
    """Place of a dotted name among the rooms; None for a name that stands in a front door."""
    found = [place for place, package in enumerate(ROOMS) if within(name, package)]
    return found[0] if found else None


ALL = [m for package in ("nlp_gait", "metaheuristics", "compare") for m in modules(package)]


def wrong_imports(module: str) -> Iterator[str]:
    """What a module imports from where it may not."""
    own = room(module)
    if own is None:
        if module not in DOORS:
            yield "stands in no room"
        return
    for name in imports(module):
        if within(name, "nlp_gait", "metaheuristics", "compare"):
            imported = room(name)
            if imported is None:  # a front door, of packages that come before this one
                if own <= ROOMS.index("nlp_gait.export"):
                    yield f"imports {name} from a front door"
                if within(name, "compare"):
                    yield f"imports {name} from its own front door"
            elif imported > own:
                yield f"imports {name} from a later room"


def test_a_room_imports_earlier_rooms_only() -> None:
    assert not {module: wrong for module in ALL if (wrong := list(wrong_imports(module)))}


@pytest.mark.parametrize("family", FAMILIES)
def test_families_of_problems_know_nothing_of_each_other(family: str) -> None:
    others = tuple(f"nlp_gait.gaits.{other}" for other in FAMILIES if other != family)
    for module in modules(f"nlp_gait/gaits/{family}"):
        bad = [name for name in imports(module) if within(name, *others)]
        assert not bad, f"{module} imports {bad}"


@pytest.mark.parametrize("module", modules("metaheuristics"))
def test_search_algorithms_know_neither_casadi_nor_gaits(module: str) -> None:
    bad = [name for name in imports(module) if within(name, "casadi", "nlp_gait", "compare")]
    assert not bad, f"{module} imports {bad}"


def test_the_import_parser_sees_every_kind_of_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tests above stand on it."""
    package = tmp_path / "box" / "inner"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("from . import a\nfrom .. import b\n")
    (package / "leaf.py").write_text("import os.path\nfrom .a import c\nfrom ..d import e\ndef f():\n    import json\n")
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path)
    assert modules("box") == ["box.inner", "box.inner.leaf"]
    assert list(imports("box.inner")) == ["box.inner.a", "box.b"]
    assert sorted(imports("box.inner.leaf")) == ["box.d.e", "box.inner.a.c", "json", "os.path"]


@pytest.mark.parametrize(
    ("package", "unwanted"),
    [
        ("nlp_gait", ("scipy.optimize", "matplotlib.pyplot", "metaheuristics", "compare")),
        ("metaheuristics", ("casadi", "nlp_gait", "matplotlib")),
    ],
)
def test_importing_a_package_costs_only_what_it_needs(package: str, unwanted: tuple[str, ...]) -> None:
    program = f"import sys, {package}; print(*sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    loaded = set(done.stdout.split())
    assert package in loaded
    assert not loaded & set(unwanted)
