"""The dependency rule: imports go only from the later layers to the earlier ones, and importing stays cheap."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Earlier layers know nothing of later ones.
LAYERS = ("errors", "files", "robots", "symbolic", "problems", "backends")
# Where search and comparison may be called from.
COMMAND_LINE = ("nlp_gait.cli", "nlp_gait.__main__")


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


def layer(module: str) -> int | None:
    parts = module.split(".")
    return LAYERS.index(parts[1]) if parts[0] == "nlp_gait" and len(parts) > 1 and parts[1] in LAYERS else None


@pytest.mark.parametrize("module", [m for m in modules("nlp_gait") if layer(m) is not None])
def test_a_layer_imports_earlier_layers_only(module: str) -> None:
    own = layer(module)
    assert own is not None
    for name in imports(module):
        if within(name, "nlp_gait"):
            imported = layer(name)
            assert imported is not None, f"{module} imports {name}, which is in no earlier layer"
            assert imported <= own, f"{module} imports {name} from a later layer"


@pytest.mark.parametrize("module", modules("metaheuristics"))
def test_search_algorithms_know_neither_casadi_nor_gaits(module: str) -> None:
    bad = [name for name in imports(module) if within(name, "casadi", "nlp_gait", "compare")]
    assert not bad, f"{module} imports {bad}"


@pytest.mark.parametrize("module", [m for m in modules("nlp_gait") if not within(m, *COMMAND_LINE)])
def test_only_the_command_line_joins_gaits_with_search_and_comparison(module: str) -> None:
    bad = [name for name in imports(module) if within(name, "metaheuristics", "compare", *COMMAND_LINE)]
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
