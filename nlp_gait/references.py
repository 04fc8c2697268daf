"""Code of one's own by name: ``file.py:name``, ``module:name``, or an installed package's entry point.

Code runs because it was named in a call, or because it was installed. What a file of data names is not run: it is looked up
among what was named in this process (``named_as``). A file is run once for each content: after an edit it is another module.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from functools import cache, lru_cache
from importlib.abc import SourceLoader
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Literal, NamedTuple, TypeVar

from nlp_gait.errors import GaitError, OwnCodeError, unknown
from nlp_gait.files import check_path, read_bytes

T = TypeVar("T")
Kind = Literal["problem", "algorithm"]

# Groups of entry points, for ``[project.entry-points."nlp_gait.problems"]`` of another package.
GROUPS: Mapping[Kind, str] = {"problem": "nlp_gait.problems", "algorithm": "nlp_gait.algorithms"}
ENDING = ".py"
LARGEST_SOURCE = 4 * 2**20  # bytes

_named: dict[str, str] = {}


class Reference(NamedTuple):
    """Where an object of one's own is.

    Attributes:
        home: absolute path of a file, or dotted name of a module.
        name: of the object in it.
    """

    home: str
    name: str

    @property
    def is_file(self) -> bool:
        """Whether the home is a file."""
        return self.home.endswith(ENDING)

    @property
    def short(self) -> str:
        """Without folders: what stays if the file is moved."""
        return f"{Path(self.home).name if self.is_file else self.home}:{self.name}"


def is_reference(text: str) -> bool:
    """Whether a text has the form ``file.py:name`` or ``module:name``."""
    home, colon, name = text.rpartition(":")
    return bool(colon) and name.isidentifier() and (home.endswith(ENDING) or _is_dotted(home))


def is_own(text: str, kind: Kind) -> bool:
    """Whether a text names code of one's own: a reference, or an entry point."""
    return is_reference(text) or text in installed(kind)


def installed(kind: Kind) -> dict[str, str]:
    """References of installed packages' entry points by name."""
    return dict(_entry_points(kind))


@cache
def _entry_points(kind: Kind) -> tuple[tuple[str, str], ...]:
    """Name and reference of each, looked for once: to go through all packages takes long."""
    return tuple((point.name, point.value) for point in entry_points(group=GROUPS[kind]))


def short_name(text: str) -> str:
    """Name of the object alone, for tables and names of files; an entry point's name is its own."""
    return text.rpartition(":")[2] if is_reference(text) else text


def reference(text: str, kind: Kind) -> Reference:
    """Where the object is, by a reference or the name of an entry point."""
    home, _, name = installed(kind).get(text, text).rpartition(":")
    return Reference(os.path.abspath(home) if home.endswith(ENDING) else home, name)


def name_code(text: str, kind: Kind) -> None:
    """Note that code was named by whoever calls: files of data that name it too may use it from now on."""
    _named[reference(text, kind).short] = text if is_reference(text) else ""


def named_as(text: str, kind: Kind, owner: str) -> str:
    """What a file of data names, as it was named in this process; an installed entry point needs no naming.

    Args:
        text: reference as the file has it.
        kind: of code.
        owner: the file, for messages.

    Raises:
        OwnCodeError: it was not named.
    """
    if not is_reference(text) or text in installed(kind):
        return text
    short = reference(text, kind).short
    if short not in _named:
        raise OwnCodeError(
            f"{owner} needs code of your own, {text!r}, which runs only if you name it: add --code {text} (in Python, "
            f"call nlp_gait.load({text!r}) before)"
        )
    return _named[short] or text


def source_sha256(text: str, kind: Kind) -> str:
    """Hash of the source that an object is made of; nothing of it is run.

    That is its own statement in the file or module, those that bind a name which it uses, directly or not, and those that bind
    none; and the whole of every file beside it that they import. Comments and the form of the text do not count.
    """
    found = reference(text, kind)
    path, content = _source(found, text)
    return source_digest(Path(path), content, found.name)


def source_digest(path: Path, content: bytes, name: str) -> str:
    """Hash of the source that a name of a file is made of, see ``source_sha256``; of the whole file where it cannot be told."""
    try:
        used, parts = _parsed(content, name)
    except (SyntaxError, ValueError):
        return hashlib.sha256(content).hexdigest()
    beside = [hashlib.sha256(file.read_bytes()).hexdigest() for file in _beside(path, used)]
    return hashlib.sha256("\n".join([*parts, *beside]).encode()).hexdigest()


@lru_cache(maxsize=16)
def _parsed(content: bytes, name: str) -> tuple[list[ast.stmt], list[str]]:
    """Statements of a file that a name depends on, and what counts of each."""
    used = _used_by(name, ast.parse(content).body)
    return used, [ast.dump(statement) for statement in used]


def _used_by(name: str, body: Sequence[ast.stmt]) -> list[ast.stmt]:
    """Statements of a module that a name depends on, in their order."""
    body = [statement for statement in body if not _is_idle(statement)]
    bound = [set(_bound([statement])) for statement in body]
    if any("*" in names for names in bound):
        return list(body)
    wanted, taken = {name}, set[int]()
    while True:
        more = {i for i, names in enumerate(bound) if i not in taken and (not names or names & wanted)}
        if not more:
            return [body[i] for i in sorted(taken)]
        taken |= more
        for i in more:
            nodes = list(ast.walk(body[i]))
            wanted |= {node.id for node in nodes if isinstance(node, ast.Name)}
            # Names in annotations that are texts, and in texts that ask for a name.
            wanted |= {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def _is_idle(statement: ast.stmt) -> bool:
    """Whether a statement does nothing where a file is loaded: a docstring, or what stands under ``__name__ == "__main__"``."""
    if isinstance(statement, ast.If):
        return ast.unparse(statement.test) in ("__name__ == '__main__'", "'__main__' == __name__")
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _beside(path: Path, statements: Sequence[ast.stmt]) -> list[Path]:
    """Files of the same folder that statements import, and that those import."""
    found: dict[Path, None] = {}
    waiting: list[ast.AST] = list(statements)
    while waiting:
        for node in ast.walk(waiting.pop()):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
            for name in names:
                stem = path.parent.joinpath(*name.split("."))
                for file in (stem.with_suffix(ENDING), stem / "__init__.py"):
                    if file != path and file not in found and file.is_file():
                        found[file] = None
                        with suppress(SyntaxError, ValueError):
                            waiting.append(ast.parse(file.read_bytes()))
    return list(found)


def check_reference(text: str, kind: Kind) -> None:
    """Refuse what cannot be there, without running anything: no such file or module, no such name at its top level.

    Raises:
        OwnCodeError: no such file or module.
        UnknownNameError: no such name.
    """
    found = reference(text, kind)
    try:
        tree = ast.parse(_source(found, text)[1])
    except (SyntaxError, ValueError):
        return  # running it says more
    names = set(_bound(tree.body))
    if found.name not in names and "*" not in names:
        raise unknown(f"name in {Path(found.home).name}", found.name, names)


def _bound(body: Sequence[ast.AST]) -> Iterator[str]:
    """Names that statements bind, those within functions and classes left out."""
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            yield from (alias.asname or alias.name.partition(".")[0] for alias in node.names)
        else:
            yield from _bound(list(ast.iter_child_nodes(node)))


def load_object(text: str, kind: Kind) -> object:
    """The object, running its file or importing its module if that was not done yet.

    Raises:
        OwnCodeError: no such file or module, or it fails.
        UnknownNameError: no such name in it.
    """
    found = reference(text, kind)
    path, content = _source(found, text)
    if found.is_file:
        module = guarded(text, path, lambda: _module(path, content))
    else:
        module = guarded(text, path, lambda: importlib.import_module(found.home))
    if not hasattr(module, found.name):
        raise unknown(f"name in {found.home}", found.name, [n for n in vars(module) if not n.startswith("_")])
    return getattr(module, found.name)


def guarded(text: str, path: str, call: Callable[[], T]) -> T:
    """What a call of one's own code gives; what it prints goes to standard error.

    Raises:
        OwnCodeError: it fails in any way, with the line of the file at which it does.
    """
    try:
        with redirect_stdout(sys.stderr):
            return call()
    except (KeyboardInterrupt, GaitError):
        raise
    except BaseException as error:  # SystemExit too: it must not end the command
        raise OwnCodeError(f"{text!r} fails{place_of(error, path)}: {_said(error)}") from error


def place_of(error: BaseException, path: str) -> str:
    """The last line of a file that an error went through, as `` at line 3, `x = 1 / 0` ``; empty if none."""
    lines = [frame for frame in traceback.extract_tb(error.__traceback__) if os.path.abspath(frame.filename) == path]
    return f" at line {lines[-1].lineno}, `{lines[-1].line}`" if lines else ""


def _said(error: BaseException) -> str:
    text = " ".join(str(error).split())
    if "Wrong number or type of arguments" in text:  # of CasADi's wrapper, which then lists all overloads
        text = "a function of CasADi does not take these arguments"
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


class _Text(SourceLoader):
    """Runs the very bytes that were hashed; a compiled copy beside the file may be of an older text."""

    def __init__(self, path: str, content: bytes) -> None:
        self._path, self._content = path, content

    def get_filename(self, fullname: str) -> str:
        return self._path

    def get_data(self, path: str | bytes) -> bytes:
        if path != self._path:
            raise OSError(path)
        return self._content


def _module(path: str, content: bytes) -> ModuleType:
    digest = hashlib.sha256(path.encode() + b"\0" + content).hexdigest()[:16]
    name = f"nlp_gait_own_{digest}_{Path(path).stem}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_loader(name, _Text(path, content), origin=path)
    assert spec is not None and spec.loader is not None  # it was just made; for the type checker
    module = importlib.util.module_from_spec(spec)
    folder = str(Path(path).parent)
    if folder not in sys.path:
        sys.path.append(folder)  # last, so that no file beside it hides a package
    sys.modules[name] = module  # before it runs: its data classes look there
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _source(found: Reference, text: str) -> tuple[str, bytes]:
    """Path and content of the file or module."""
    if found.is_file:
        path = found.home
        check_path(path, f"code of {text!r}, {path!r}", OwnCodeError)
    else:
        try:
            spec = importlib.util.find_spec(found.home)
        except (ImportError, ValueError):
            spec = None
        if spec is None or not spec.origin or not spec.origin.endswith(ENDING):
            raise OwnCodeError(
                f"{text!r}: no module {found.home!r} is installed; name a file as {found.home.replace('.', '/')}.py:{found.name}"
            )
        path = spec.origin
    return path, read_bytes(Path(path), f"code of {text!r},", error=OwnCodeError, at_most=LARGEST_SOURCE)


def _is_dotted(text: str) -> bool:
    return all(part.isidentifier() for part in text.split("."))
