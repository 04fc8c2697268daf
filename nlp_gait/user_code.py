"""User code by name: ``file.py:name``, ``module:name``, an entry point of an installed package, or ``cmd:COMMAND``, a program.

Code runs because the user named it in a call, or because it is installed. A name in a data file runs nothing: it must match code
that was named in this process (``resolve_code``). A file and the modules that it imports from its own folder are read once; what
was read is hashed, and runs. They are modules of their own: helpers of two files never meet, and an edited file is another one.
"""

import ast
import builtins
import hashlib
import importlib
import importlib.util
import os
import re
import shlex
import shutil
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import cache, cached_property, partial
from importlib.abc import ExecutionLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.metadata import entry_points
from pathlib import Path
from symtable import symtable
from types import ModuleType
from typing import Any, Literal, TypeVar

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

_allowed: list[str] = []


@dataclass(frozen=True)
class SourceFiles:
    """A user's file and the files that it imports from its folder, as they were read."""

    folder: Path
    contents: Mapping[str, bytes]  #: by path relative to the folder; the file itself comes first

    @property
    def main(self) -> Path:
        """The file itself."""
        return self.folder / next(iter(self.contents))

    @cached_property
    def digest(self) -> str:
        """Hash of all files, wherever they lie."""
        hashes = {name: hashlib.sha256(content).hexdigest() for name, content in self.contents.items()}
        return hashlib.sha256(repr(sorted(hashes.items())).encode()).hexdigest()

    @property
    def prefix(self) -> str:
        """Package of these modules, whose name contains the hash of all of them."""
        return f"nlp_gait_user_{hashlib.sha256(f'{self.folder}{self.digest}'.encode()).hexdigest()[:16]}"


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
        words = split_command(text)
        scripts = (word for word in words[1:] if Path(word).suffix[1:].isalpha() and not word.startswith("-"))
        return Path(next(scripts, words[0])).stem
    return text.rpartition(":")[2] if is_reference(text) else text


def shorten_reference(text: str) -> str:
    """Return a reference without folders, which is unchanged when the files are moved; other texts as they are."""
    if is_program(text):
        words = split_command(text)
        return PROGRAM + shlex.join(Path(word).name if os.path.isfile(word) else word for word in words)
    home, colon, name = text.rpartition(":")
    return f"{Path(home).name}:{name}" if colon and home.endswith(ENDING) else text


def allow_code(text: str) -> None:
    """Allow data files to refer to code, because the user named it."""
    if is_reference(text) and text not in _allowed:
        _allowed.append(text)


def resolve_code(text: str, kind: Kind, owner: str) -> str:
    """Return code of a data file (the owner) as the user named it in this process; UserCodeError if that is missing.

    Entry points are always allowed.
    """
    if not is_reference(text) or text in find_entry_points(kind):
        return text
    named = [allowed for allowed in _allowed if shorten_reference(allowed) == shorten_reference(text)]
    if not named:
        raise UserCodeError(
            f"{owner} needs your code {text!r}, which runs only if you name it: add --code {shlex.quote(text)} (in Python, "
            f"call nlp_gait.load({text!r}) first)"
        )
    return text if text in named else named[-1]


def split_command(text: str) -> tuple[str, ...]:
    """Return the words of ``cmd:COMMAND``; raises UserCodeError if a quote is open or there are none."""
    try:
        words = tuple(shlex.split(text.removeprefix(PROGRAM)))
    except ValueError as error:
        raise UserCodeError(f"{text!r}: {error}; write {PROGRAM} and a command as in a shell") from error
    if not words:
        raise UserCodeError(f"{text!r} names no program; write for example {PROGRAM}octave-cli --quiet my_ga.m")
    return words


def parse_command(text: str) -> tuple[str, ...]:
    """Return the words of ``cmd:COMMAND``; raises UserCodeError as ``split_command``, and if there is no such program."""
    words = split_command(text)
    if shutil.which(words[0]) is None:
        raise UserCodeError(f"{text!r}: no program {words[0]!r} on this machine; install it, or give its path")
    return words


def find_source(text: str, kind: Kind) -> Path:
    """Return the file of an object, or of a program the script that it names, else the program itself; raises UserCodeError."""
    if is_program(text):
        words = parse_command(text)
        scripts = (word for word in words if os.path.isfile(word) and not (word == words[0] and os.path.isabs(word)))
        return Path(os.path.abspath(next(scripts, None) or shutil.which(words[0]) or words[0]))
    home, name = _split_reference(text, kind)
    if home.endswith(ENDING):
        check_path(home, f"code of {text!r}, {home!r}", UserCodeError)
        return Path(home)
    try:
        spec = importlib.util.find_spec(home)
    except (ImportError, ValueError):
        spec = None
    if spec is None or not spec.origin or not spec.origin.endswith(ENDING):
        file = f"{home.replace('.', '/')}.py:{name}"
        raise UserCodeError(f"{text!r}: no module {home!r} is installed; name a file as {file}")
    return Path(spec.origin)


def _split_reference(text: str, kind: Kind) -> tuple[str, str]:
    """Return the absolute path of a file or the name of a module, and the name of the object in it."""
    home, _, name = find_entry_points(kind).get(text, text).rpartition(":")
    return os.path.abspath(home) if home.endswith(ENDING) else home, name


def read_source_files(text: str, kind: Kind) -> SourceFiles:
    """Return the files of an object, as they are now: its own, and those in its folder that it imports; nothing is run.

    A program's file imports the files of the same ending in its folder whose names occur in it.
    """
    main = find_source(text, kind)
    contents, waiting = {main: _read(main, f"code of {text!r},")}, [main]
    while waiting:
        importer = waiting.pop()
        for path in _find_imports(contents[importer], importer, main):
            if path not in contents:
                contents[path] = _read(path)
                waiting.append(path)
    return SourceFiles(main.parent, {path.relative_to(main.parent).as_posix(): c for path, c in contents.items()})


def _find_imports(content: bytes, path: Path, main: Path) -> Iterator[Path]:
    """Yield the files in the folder of a file, ``main``, that a source at ``path`` imports."""
    if main.suffix != ENDING:
        words = set(re.findall(rb"\w+", content)) if main.suffix else ()
        yield from (file for file in sorted(main.parent.glob(f"*{main.suffix}")) if os.fsencode(file.stem) in words)
        return
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):
        return  # running it reports the error
    for node in ast.walk(tree):
        names, folder = [], main.parent
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            names = [module, *(f"{module}.{alias.name}".strip(".") for alias in node.names)]
            folder = path.parents[node.level - 1] if 0 < node.level <= len(path.parents) else folder
        for words_of_name in (name.split(".") for name in names):
            for count in range(1, len(words_of_name) + 1):  # packages, too
                stem = folder.joinpath(*words_of_name[:count])
                yield from (file for file in (stem.with_suffix(ENDING), stem / "__init__.py") if file.is_file())


def check_reference(text: str, kind: Kind) -> None:
    """Check, without running anything, that an object can exist; raises UserCodeError (no file) or UnknownNameError (no name)."""
    path = find_source(text, kind)
    if is_program(text):
        return
    content, name = _read(path, f"code of {text!r},"), _split_reference(text, kind)[1]
    try:
        symbols = symtable(importlib.util.decode_source(content), str(path), "exec").get_symbols()
    except (SyntaxError, ValueError):
        return  # running it reports the error
    names = [symbol.get_name() for symbol in symbols if symbol.is_assigned() or symbol.is_imported()]
    if name not in names and not IMPORTS_ALL.search(content):
        raise unknown(f"name in {path.name}", name, names)


def load_object(text: str, kind: Kind, files: SourceFiles | None = None) -> object:
    """Return an object; runs its file or imports its module on the first call; raises UserCodeError or UnknownNameError.

    ``files`` are those of a file that were read before; by default they are read now.
    """
    if is_program(text):
        raise UserCodeError(f"{text!r} is a program: it can be an algorithm, not a {kind}")
    home, name = _split_reference(text, kind)
    full = home
    if home.endswith(ENDING):
        files = files or read_source_files(text, kind)
        full = f"{files.prefix}.{files.main.stem}"
        if files.prefix not in sys.modules:
            sys.meta_path.append(UserModules(files))
    else:
        find_source(text, kind)  # it explains what is missing
    module = call_user_code(text, partial(importlib.import_module, full))
    if not hasattr(module, name):
        raise unknown(f"name in {home}", name, [n for n in vars(module) if not n.startswith("_")])
    return getattr(module, name)


def forget_code(text: str) -> None:
    """Let a file that was loaded run again when it is loaded the next time."""
    prefix = read_source_files(text, "problem").prefix
    for name in [name for name in sys.modules if name.startswith(prefix)]:
        del sys.modules[name]


class UserModules(MetaPathFinder, ExecutionLoader):
    """Finder and loader of a user's files as they were read, in their package; see ``SourceFiles.prefix``."""

    def __init__(self, files: SourceFiles) -> None:
        self._files = files

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return the specification of one of the modules; None for another one."""
        if fullname.partition(".")[0] != self._files.prefix:
            return None
        if self._find(fullname):
            return importlib.util.spec_from_loader(fullname, self)
        folder = f"{self._get_path(fullname)}/".lstrip("/")
        is_folder = any(name.startswith(folder) for name in self._files.contents)
        return ModuleSpec(fullname, None, is_package=True) if is_folder else None

    def get_filename(self, fullname: str) -> str:
        """Return the path of a module's file."""
        return str(self._files.folder / self._find(fullname))

    def get_source(self, fullname: str) -> str:
        """Return the source of a module."""
        return importlib.util.decode_source(self._files.contents[self._find(fullname)])

    def is_package(self, fullname: str) -> bool:
        """Return whether a module contains others."""
        return self._find(fullname).endswith("__init__.py")

    def exec_module(self, module: ModuleType) -> None:
        """Run a module; what it imports is looked for among these files first, as for scripts."""
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": self._import}
        super().exec_module(module)

    def _get_path(self, fullname: str) -> str:
        return fullname.removeprefix(self._files.prefix).strip(".").replace(".", "/")

    def _find(self, fullname: str) -> str:
        path = self._get_path(fullname)
        return next((name for name in (path + ENDING, f"{path}/__init__.py") if name in self._files.contents), "")

    def _import(
        self, name: str, globals: Any = None, locals: Any = None, fromlist: Sequence[str] = (), level: int = 0
    ) -> ModuleType:
        """Import as ``__import__``."""
        top, prefix = name.partition(".")[0], self._files.prefix
        if level or self.find_spec(f"{prefix}.{top}") is None:
            return builtins.__import__(name, globals, locals, fromlist or (), level)
        module = builtins.__import__(f"{prefix}.{name}", globals, locals, fromlist or (), 0)
        return module if fromlist else sys.modules[f"{prefix}.{top}"]


def call_user_code(text: str, call: Callable[[], T]) -> T:
    """Return the result of user code, which prints to standard error; raises UserCodeError with the line where it fails."""
    try:
        with redirect_stdout(sys.stderr):
            return call()
    except (KeyboardInterrupt, GaitError):
        raise
    except BaseException as error:  # SystemExit too: it must not end the command
        path = os.path.abspath(text.rpartition(":")[0])
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame for frame in frames if os.path.abspath(frame.filename) == path]
        where = f" at line {lines[-1].lineno}, `{lines[-1].line}`" if lines else ""
        message = " ".join(str(error).split())
        if "Wrong number or type of arguments" in message:  # of CasADi's wrapper, which then lists all overloads
            message = "a function of CasADi does not take these arguments"
        what = type(error).__name__ + (message and f": {message}")
        raise UserCodeError(f"{text!r} fails{where}: {what}") from error


def _read(path: Path, what: str = "code") -> bytes:
    at_most = LARGEST_SOURCE if path.suffix == ENDING else LARGEST_PROGRAM
    return read_bytes(path, what, error=UserCodeError, at_most=at_most)
