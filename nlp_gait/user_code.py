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
from importlib.metadata import entry_points
from pathlib import Path
from symtable import symtable
from types import ModuleType
from typing import Any, Literal, NamedTuple, TypeVar

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


class CodeReference(NamedTuple):
    """Place of an object in user code."""

    home: str  # absolute path of a file, or dotted name of a module
    name: str  # of the object in it; the text itself for a program

    @property
    def is_file(self) -> bool:
        """Whether the home is a file."""
        return os.path.isabs(self.home)


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
    def hashes(self) -> dict[str, str]:
        """SHA-256 of each file by its relative path."""
        return {name: hashlib.sha256(content).hexdigest() for name, content in self.contents.items()}

    @cached_property
    def digest(self) -> str:
        """Hash of all files, wherever they lie."""
        return hash_names(self.hashes)


def hash_names(hashes: Mapping[str, str]) -> str:
    """Return the hash of the SHA-256 of files by their relative paths."""
    return hashlib.sha256(repr(sorted(hashes.items())).encode()).hexdigest()


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


def parse_reference(text: str, kind: Kind) -> CodeReference:
    """Return the place of an object from a reference or the name of an entry point."""
    if is_program(text):
        return CodeReference(_find_program_file(text), text)
    home, _, name = find_entry_points(kind).get(text, text).rpartition(":")
    return CodeReference(os.path.abspath(home) if home.endswith(ENDING) else home, name)


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


def _find_program_file(text: str) -> str:
    """Return the absolute path of a command's own file: the script that it names, else the program."""
    words = split_command(text)
    scripts = (word for word in words if os.path.isfile(word) and not (word == words[0] and os.path.isabs(word)))
    return os.path.abspath(next(scripts, None) or shutil.which(words[0]) or words[0])


def read_source_files(text: str, kind: Kind) -> SourceFiles:
    """Return the files of an object, as they are now: its own, and those in its folder that it imports; nothing is run.

    A program's file imports the files of the same ending in its folder whose names occur in it.
    """
    if is_program(text):
        parse_command(text)
    main = Path(_find_source(parse_reference(text, kind), text))
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
    if is_program(text):
        parse_command(text)
        return
    place = parse_reference(text, kind)
    path = _find_source(place, text)
    content = _read(Path(path), f"code of {text!r},")
    try:
        symbols = symtable(importlib.util.decode_source(content), path, "exec").get_symbols()
    except (SyntaxError, ValueError):
        return  # running it reports the error
    names = [symbol.get_name() for symbol in symbols if symbol.is_assigned() or symbol.is_imported()]
    if place.name not in names and not IMPORTS_ALL.search(content):
        raise unknown(f"name in {Path(place.home).name}", place.name, names)


def load_object(text: str, kind: Kind, files: SourceFiles | None = None) -> object:
    """Return an object; runs its file or imports its module on the first call; raises UserCodeError or UnknownNameError.

    ``files`` are those of a file that were read before; by default they are read now.
    """
    if is_program(text):
        raise UserCodeError(f"{text!r} is a program: it can be an algorithm, not a {kind}")
    place = parse_reference(text, kind)
    if place.is_file:
        files = files or read_source_files(text, kind)
        run = partial(UserModules(files).load, files.main.stem)
    else:
        run = partial(importlib.import_module, place.home)
    module = call_user_code(text, _find_source(place, text), run)
    if not hasattr(module, place.name):
        raise unknown(f"name in {place.home}", place.name, [n for n in vars(module) if not n.startswith("_")])
    return getattr(module, place.name)


def forget_code(text: str) -> None:
    """Let a file that was loaded run again when it is loaded the next time."""
    prefix = UserModules(read_source_files(text, "problem")).prefix
    for name in [name for name in sys.modules if name.startswith(prefix)]:
        del sys.modules[name]


class UserModules:
    """The modules of a user's file, under names that contain the hash of all of them."""

    def __init__(self, files: SourceFiles) -> None:
        self._files = files
        self.prefix = f"nlp_gait_user_{hashlib.sha256(f'{files.folder}{files.digest}'.encode()).hexdigest()[:16]}"

    def load(self, name: str) -> ModuleType:
        """Return a module by its name, dotted in a package; runs it on the first call."""
        full, path = f"{self.prefix}.{name}", name.replace(".", "/")
        if full in sys.modules:
            return sys.modules[full]
        parent, _, last = name.rpartition(".")
        if parent:
            self.load(parent)
        is_package = f"{path}/__init__.py" in self._files.contents
        file = f"{path}/__init__.py" if is_package else path + ENDING
        module = ModuleType(full)
        module.__file__ = str(self._files.folder / file)
        module.__package__ = full if is_package else full.rpartition(".")[0]
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": self._import}
        sys.modules[full] = module  # before it runs: its data classes look there
        try:
            # What was read and hashed, not what is in the file now.
            exec(compile(self._files.contents[file], module.__file__, "exec", dont_inherit=True), vars(module))  # noqa: S102
        except BaseException:
            del sys.modules[full]
            raise
        if parent:
            setattr(sys.modules[f"{self.prefix}.{parent}"], last, module)
        return module

    def _contain(self, name: str) -> bool:
        path = name.replace(".", "/")
        return path + ENDING in self._files.contents or f"{path}/__init__.py" in self._files.contents

    def _import(
        self,
        name: str,
        globals: Mapping[str, Any] | None = None,
        locals: Mapping[str, Any] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        """Import as ``__import__``; a module of these files comes before one of that name elsewhere, as for scripts."""
        if level:
            package = str((globals or {}).get("__package__", "")).split(".")[1:]  # without the prefix
            name = ".".join(filter(None, [*package[: len(package) - level + 1], name]))
            if not name:
                raise ImportError("attempted relative import with no known parent package")
        if not level and not self._contain(name.partition(".")[0]):
            return builtins.__import__(name, globals, locals, fromlist or (), level)
        if name and not self._contain(name):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        for item in fromlist or ():
            inner = f"{name}.{item}".strip(".")
            if self._contain(inner):
                self.load(inner)
        return self.load(name if fromlist else name.partition(".")[0])


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


def _find_source(place: CodeReference, text: str) -> str:
    if place.is_file:
        check_path(place.home, f"code of {text!r}, {place.home!r}", UserCodeError)
        return place.home
    try:
        spec = importlib.util.find_spec(place.home)
    except (ImportError, ValueError):
        spec = None
    if spec is None or not spec.origin or not spec.origin.endswith(ENDING):
        file = f"{place.home.replace('.', '/')}.py:{place.name}"
        raise UserCodeError(f"{text!r}: no module {place.home!r} is installed; name a file as {file}")
    return spec.origin


def _read(path: Path, what: str = "code") -> bytes:
    at_most = LARGEST_SOURCE if path.suffix == ENDING else LARGEST_PROGRAM
    return read_bytes(path, what, error=UserCodeError, at_most=at_most)
