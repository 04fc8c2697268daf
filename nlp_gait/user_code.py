"""User code by name: ``file.py:name``, ``module:name``, an entry point of an installed package, or ``cmd:COMMAND``, a program.

Code runs because the user named it in a call, or because it is installed. A name in a data file runs nothing: it must match code
that was named in this process (``resolve_code``). A file runs once per content: after an edit it is another module.
"""

import ast
import hashlib
import importlib
import importlib.util
import os
import re
import shlex
import shutil
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from functools import cache, lru_cache, partial
from importlib.metadata import entry_points
from pathlib import Path
from symtable import symtable
from types import ModuleType
from typing import Literal, NamedTuple, TypeVar

from nlp_gait.errors import GaitError, UserCodeError, unknown
from nlp_gait.files import check_path, read_bytes

T = TypeVar("T")
Kind = Literal["problem", "algorithm", "limit", "paper"]

# Groups of entry points, for ``[project.entry-points."nlp_gait.problems"]`` of another package.
GROUPS: Mapping[Kind, str] = {
    "problem": "nlp_gait.problems",
    "algorithm": "nlp_gait.algorithms",
    "limit": "nlp_gait.gait_limits",
    "paper": "nlp_gait.papers",
}
ENDING = ".py"
PROGRAM = "cmd:"
LARGEST_SOURCE = 4 * 2**20  # bytes
LARGEST_PROGRAM = 64 * 2**20  # it may be compiled
IMPORTS_ALL = re.compile(rb"\bimport\s*\*")
HAS_DOCSTRING = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)

_allowed: dict[str, str] = {}


class CodeReference(NamedTuple):
    """Place of an object in user code."""

    home: str  # absolute path of a file, or dotted name of a module
    name: str  # of the object in it; the text itself for a program

    @property
    def is_file(self) -> bool:
        """Whether the home is a file."""
        return os.path.isabs(self.home)

    @property
    def short(self) -> str:
        """Without folders: unchanged when the file is moved."""
        return f"{Path(self.home).name if self.is_file else self.home}:{self.name}"


def is_program(text: str) -> bool:
    """Return whether a text has the form ``cmd:COMMAND``."""
    return text.startswith(PROGRAM)


def is_reference(text: str) -> bool:
    """Return whether a text has the form ``file.py:name``, ``module:name`` or ``cmd:COMMAND``."""
    home, colon, name = text.rpartition(":")
    is_module = all(word.isidentifier() for word in home.split("."))
    return is_program(text) or (bool(colon) and name.isidentifier() and (home.endswith(ENDING) or is_module))


def is_user_code(text: str, kind: Kind) -> bool:
    """Return whether a text names user code: a reference, or an entry point."""
    return is_reference(text) or text in find_entry_points(kind)


@cache  # searching all packages is slow
def find_entry_points(kind: Kind) -> Mapping[str, str]:
    """Return the references of installed packages' entry points by name."""
    return {point.name: point.value for point in entry_points(group=GROUPS[kind])}


def shorten_name(text: str) -> str:
    """Return the name of the object alone, for tables and file names; an entry point's name is returned unchanged."""
    if is_program(text):
        return Path(_find_program_file(text)).stem
    return text.rpartition(":")[2] if is_reference(text) else text


def parse_reference(text: str, kind: Kind) -> CodeReference:
    """Return the place of an object from a reference or the name of an entry point."""
    if is_program(text):
        return CodeReference(_find_program_file(text), text)
    home, _, name = find_entry_points(kind).get(text, text).rpartition(":")
    return CodeReference(os.path.abspath(home) if home.endswith(ENDING) else home, name)


def allow_code(text: str, kind: Kind) -> None:
    """Allow data files to refer to code, because the user named it."""
    _allowed[parse_reference(text, kind).short] = text if is_reference(text) else ""


def resolve_code(text: str, kind: Kind, owner: str) -> str:
    """Return code of a data file (the owner) as the user named it in this process; UserCodeError if that is missing.

    Entry points are always allowed.
    """
    if not is_reference(text) or text in find_entry_points(kind):
        return text
    short = parse_reference(text, kind).short
    if short not in _allowed:
        raise UserCodeError(
            f"{owner} needs your code {text!r}, which runs only if you name it: add --code {shlex.quote(text)} (in Python, "
            f"call nlp_gait.load({text!r}) first)"
        )
    return _allowed[short] or text


def parse_command(text: str) -> tuple[str, ...]:
    """Return the words of ``cmd:COMMAND``; raises UserCodeError if there is no such program, or a quote is open."""
    try:
        words = tuple(shlex.split(text.removeprefix(PROGRAM)))
    except ValueError as error:
        raise UserCodeError(f"{text!r}: {error}; write {PROGRAM} and a command as in a shell") from error
    if not words:
        raise UserCodeError(f"{text!r} names no program; write for example {PROGRAM}octave-cli --quiet my_ga.m")
    if shutil.which(words[0]) is None:
        raise UserCodeError(f"{text!r}: no program {words[0]!r} on this machine; install it, or give its path")
    return words


def _find_program_file(text: str) -> str:
    """Return the absolute path of a command's own file: the script that it names, else the program."""
    words = parse_command(text)
    scripts = (word for word in words if os.path.isfile(word) and not (word == words[0] and os.path.isabs(word)))
    return os.path.abspath(next(scripts, None) or shutil.which(words[0]) or words[0])


def hash_source(text: str, kind: Kind) -> str:
    """Return the hash of the source of an object, see ``hash_file``; nothing is run."""
    return hash_file(Path(_read_source(parse_reference(text, kind), text)[0]))


def hash_file(path: Path) -> str:
    """Return the hash of a source file and of the files in its folder that it imports, without comments and docstrings.

    A file that is not Python's imports those of the same ending whose names occur in it.
    """
    contents = [
        remove_comments(content) if file.suffix == ENDING else content
        for file, content in _read_with_imports(path).items()
    ]
    return hashlib.sha256(b"".join(hashlib.sha256(content).digest() for content in contents)).hexdigest()


@lru_cache(maxsize=256)  # a study hashes its files for every record
def remove_comments(source: bytes) -> bytes:
    """Return what Python runs of a source, as text: without comments and docstrings, which change nothing."""
    try:
        return _dump(ast.parse(source)).encode()
    except (SyntaxError, ValueError):
        return source  # running it reports the error


def _dump(node: object) -> str:
    """Return a syntax tree as text; parts that are empty are left out, for other versions of Python have more of them."""
    if isinstance(node, list):
        return f"[{', '.join(map(_dump, node))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    parts = dict(ast.iter_fields(node))
    if isinstance(node, HAS_DOCSTRING) and ast.get_docstring(node, clean=False) is not None:
        parts["body"] = node.body[1:]
    return f"{type(node).__name__}({', '.join(f'{k}={_dump(v)}' for k, v in parts.items() if v not in (None, []))})"


def list_source_files(text: str, kind: Kind) -> list[Path]:
    """Return the source file of an object and the files in its folder that it imports; nothing is run."""
    return list(_read_with_imports(Path(_read_source(parse_reference(text, kind), text)[0])))


def _read_with_imports(path: Path) -> dict[Path, bytes]:
    files, waiting = {path: _read(path)}, [path]
    while waiting:
        for file in _find_imports(files[waiting.pop()], path):
            if file not in files:
                files[file] = _read(file)
                waiting.append(file)
    return files


def _find_imports(content: bytes, path: Path) -> Iterator[Path]:
    """Yield the files beside the file of an object, at ``path``, that a source imports."""
    if path.suffix != ENDING:
        words = set(re.findall(rb"\w+", content)) if path.suffix else ()
        yield from (file for file in sorted(path.parent.glob(f"*{path.suffix}")) if os.fsencode(file.stem) in words)
        return
    for name in _parse_imports(content):
        stem = path.parent.joinpath(*name.split("."))
        yield from (file for file in (stem.with_suffix(ENDING), stem / "__init__.py") if file.is_file())


@lru_cache(maxsize=32)  # a study hashes its files for every record
def _parse_imports(content: bytes) -> tuple[str, ...]:
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):
        return ()  # running it reports the error
    names: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            names += [module, *(f"{module}.{alias.name}".strip(".") for alias in node.names)]
    return tuple(filter(None, names))


def check_reference(text: str, kind: Kind) -> None:
    """Check, without running anything, that an object can exist; raises UserCodeError (no file) or UnknownNameError (no name)."""
    place = parse_reference(text, kind)
    if is_program(text):
        return
    path, content = _read_source(place, text)
    try:
        symbols = symtable(importlib.util.decode_source(content), path, "exec").get_symbols()
    except (SyntaxError, ValueError):
        return  # running it reports the error
    names = [symbol.get_name() for symbol in symbols if symbol.is_assigned() or symbol.is_imported()]
    if place.name not in names and not IMPORTS_ALL.search(content):
        raise unknown(f"name in {Path(place.home).name}", place.name, names)


def load_object(text: str, kind: Kind) -> object:
    """Return an object; runs its file or imports its module on the first call; raises UserCodeError or UnknownNameError."""
    if is_program(text):
        raise UserCodeError(f"{text!r} is a program: it can be an algorithm, not a {kind}")
    place = parse_reference(text, kind)
    path, content = _read_source(place, text)
    run = partial(_run_file, path, content) if place.is_file else partial(importlib.import_module, place.home)
    module = call_user_code(text, path, run)
    if not hasattr(module, place.name):
        raise unknown(f"name in {place.home}", place.name, [n for n in vars(module) if not n.startswith("_")])
    return getattr(module, place.name)


def call_user_code(text: str, path: str, call: Callable[[], T]) -> T:
    """Return the result of user code, which prints to standard error; raises UserCodeError with the line where it fails."""
    try:
        with redirect_stdout(sys.stderr):
            return call()
    except (KeyboardInterrupt, GaitError):
        raise
    except BaseException as error:  # SystemExit too: it must not end the command
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame for frame in frames if os.path.abspath(frame.filename) == path]
        where = f" at line {lines[-1].lineno}, `{lines[-1].line}`" if lines else ""
        message = " ".join(str(error).split())
        if "Wrong number or type of arguments" in message:  # of CasADi's wrapper, which then lists all overloads
            message = "a function of CasADi does not take these arguments"
        what = type(error).__name__ + (message and f": {message}")
        raise UserCodeError(f"{text!r} fails{where}: {what}") from error


def _run_file(path: str, content: bytes) -> ModuleType:
    digest = hashlib.sha256(path.encode() + b"\0" + content).hexdigest()[:16]
    name = f"nlp_gait_own_{digest}_{Path(path).stem}"
    if name in sys.modules:
        return sys.modules[name]
    module = ModuleType(name)
    module.__file__ = path
    folder = str(Path(path).parent)
    if folder not in sys.path:
        sys.path.append(folder)  # last, so that no file in it hides a package
    sys.modules[name] = module  # before it runs: its data classes look there
    try:
        # The bytes that were hashed; a compiled file in the cache may belong to an older text.
        exec(compile(content, path, "exec", dont_inherit=True), vars(module))  # noqa: S102  code that the user named
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _read_source(place: CodeReference, text: str) -> tuple[str, bytes]:
    if place.is_file:
        path = place.home
        check_path(path, f"code of {text!r}, {path!r}", UserCodeError)
    else:
        try:
            spec = importlib.util.find_spec(place.home)
        except (ImportError, ValueError):
            spec = None
        if spec is None or not spec.origin or not spec.origin.endswith(ENDING):
            file = f"{place.home.replace('.', '/')}.py:{place.name}"
            raise UserCodeError(f"{text!r}: no module {place.home!r} is installed; name a file as {file}")
        path = spec.origin
    return path, _read(Path(path), f"code of {text!r},")


def _read(path: Path, what: str = "code") -> bytes:
    at_most = LARGEST_SOURCE if path.suffix == ENDING else LARGEST_PROGRAM
    return read_bytes(path, what, error=UserCodeError, at_most=at_most)
