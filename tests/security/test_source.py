"""What the packages' source must not hold: code that is made from data, and shells that are given a user's words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("nlp_gait", "metaheuristics", "compare")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
# Modules that turn data into objects or code.
BANNED_MODULES = (
    "pickle",
    "cPickle",
    "dill",
    "cloudpickle",
    "shelve",
    "marshal",
    "yaml",
    "jsonpickle",
    "joblib.numpy_pickle",
)
BANNED_CALLS = (
    "eval",
    "exec",
    "compile",
    "__import__",
    "os.system",
    "os.popen",
    "os.execv",
    "joblib.load",
    "tempfile.mktemp",
)
# A source without these words has nothing that is banned, and is not parsed.
CALLED = "|".join(name.rpartition(".")[2] for name in BANNED_CALLS if name not in ("compile", "joblib.load"))
WORDS = re.compile(
    rf"\b({'|'.join(BANNED_MODULES)}|numpy_pickle|shell|subprocess|allow_pickle)\b|\.load\s*\(|"
    rf"\b({CALLED}|(?<!\.)compile)\s*\("
)


def dotted(node: ast.expr) -> str:
    """``a.b.c`` of a name or an attribute; empty for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        stem = dotted(node.value)
        return f"{stem}.{node.attr}" if stem else ""
    return ""


def faults(text: str) -> Iterator[str]:
    """What is banned in a source, with its line."""
    if not WORDS.search(text):
        return
    for node in ast.walk(ast.parse(text)):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in names:
            if any(name == banned or name.startswith(f"{banned}.") for banned in BANNED_MODULES):
                yield f"line {node.lineno}: import of {name}"  # type: ignore[attr-defined]
        if not isinstance(node, ast.Call):
            continue
        called = dotted(node.func)
        if called in BANNED_CALLS:
            yield f"line {node.lineno}: call of {called}"
        for keyword in node.keywords:
            given = keyword.value.value if isinstance(keyword.value, ast.Constant) else None
            if keyword.arg == "shell" and given is not False:
                yield f"line {node.lineno}: a shell"
            if keyword.arg == "allow_pickle" and given is not False:
                yield f"line {node.lineno}: allow_pickle"
        if called.startswith("subprocess.") and node.args and isinstance(node.args[0], (ast.Constant, ast.JoinedStr)):
            yield f"line {node.lineno}: a command as one text"
        if called == "np.load" and not any(keyword.arg == "allow_pickle" for keyword in node.keywords):
            yield f"line {node.lineno}: an archive that may hold objects"


def test_no_code_is_made_from_data() -> None:
    assert len(SOURCES) > 200
    found = {path.relative_to(ROOT).as_posix(): list(faults(path.read_text(encoding="utf-8"))) for path in SOURCES}
    assert not {name: lines for name, lines in found.items() if lines}


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from yaml import load",
        "from joblib import numpy_pickle",
        "eval('1')",
        "exec(text)",
        "os.system(f'c++ {name}')",
        "subprocess.run(command, shell=True)",
        "subprocess.run(command, shell=chosen)",
        "subprocess.run('c++ source.cpp')",
        "np.load(path)",
        "np.load(path, allow_pickle=True)",
    ],
)
def test_the_scan_finds(text: str) -> None:
    """The test above stands on it."""
    assert list(faults(text))


def test_the_scan_knows_what_is_allowed() -> None:
    assert not list(faults("subprocess.run([compiler, name], shell=False)\nmodel.eval(1)\nre.compile('a')"))
    assert not list(faults("np.load(path, allow_pickle=False)"))
