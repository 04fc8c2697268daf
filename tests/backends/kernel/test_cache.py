"""The cache of compiled code: broken, not writable, shared, or written to by another user."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from threadpoolctl import ThreadpoolController

from nlp_gait.backends.kernel import compiler as compiler_module
from nlp_gait.backends.kernel.compiler import Compiler, find_cache_folder, find_compiler, load_library
from nlp_gait.errors import CompilerError

SOURCE = 'extern "C" int answer(void) { return 42; }\n'
FLAGS = ("-O0",)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "cache"
    private = tmp_path / "private"
    private.mkdir(mode=0o700)
    monkeypatch.setenv(compiler_module.FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(tempfile, "tempdir", str(private))
    compiler_module.make_private_folder.cache_clear()
    compiler_module.warn_once.cache_clear()
    yield folder
    compiler_module.make_private_folder.cache_clear()


@pytest.fixture
def compiler() -> Compiler:
    return find_compiler()


def list_libraries(cache: Path) -> list[Path]:
    return sorted(cache.glob(f"*{compiler_module.SUFFIX}"))


def answer(compiler: Compiler) -> tuple[int, Path]:
    library, path = load_library(SOURCE, compiler, FLAGS, ("answer",))
    return library.answer(), path


def test_a_library_is_built_once(cache: Path, compiler: Compiler, monkeypatch: pytest.MonkeyPatch) -> None:
    value, path = answer(compiler)
    assert value == 42 and path.parent == cache
    assert list_libraries(cache) == [path]
    monkeypatch.setattr(Compiler, "build", None)  # would raise if it were called
    assert answer(compiler) == (42, path)


@pytest.mark.parametrize("damage", [b"", b"not a library", None])
def test_a_broken_library_is_built_again(cache: Path, compiler: Compiler, damage: bytes | None) -> None:
    _, path = answer(compiler)
    whole = path.read_bytes()
    # Replaced, not overwritten: the old file is still mapped into this process.
    path.unlink()
    path.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    assert answer(compiler)[0] == 42
    (rebuilt,) = list_libraries(cache)
    assert rebuilt.read_bytes() == whole


def test_a_library_without_the_function_is_not_trusted(cache: Path, compiler: Compiler) -> None:
    with pytest.raises(CompilerError, match="cannot be loaded"):
        load_library(SOURCE, compiler, FLAGS, ("question",))


def test_a_cache_that_cannot_be_made(cache: Path, compiler: Compiler, caplog: pytest.LogCaptureFixture) -> None:
    cache.write_text("a file")
    assert answer(compiler)[0] == 42 and find_cache_folder() != cache
    assert len(caplog.messages) == 1 and "cannot be made (File exists)" in caplog.messages[0]


def test_a_folder_whose_name_is_not_text_has_no_library_that_threadpoolctl_cannot_name(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(compiler_module.FOLDER_VARIABLE, os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9"))
    compiler_module.warn_once.cache_clear()
    assert answer(compiler)[0] == 42
    assert len(caplog.messages) == 1 and "cannot be made" in caplog.messages[0]
    assert ThreadpoolController().lib_controllers


def test_a_full_or_read_only_cache_costs_one_line(
    cache: Path, compiler: Compiler, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    replace = os.replace

    def refuse(source: Path, target: Path) -> None:
        if target.parent == cache:
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", refuse)
    value, path = answer(compiler)
    assert value == 42 and path.parent != cache
    assert not list_libraries(cache)
    assert len(caplog.messages) == 1 and "No space left on device" in caplog.messages[0]


def test_of_two_processes_at_once_one_builds(cache: Path) -> None:
    code = (
        "from nlp_gait.backends.kernel.compiler import load_library\n"
        "from nlp_gait.backends.kernel.compiler import Compiler, find_compiler\n"
        "build = Compiler.build\n"
        "Compiler.build = lambda *given: (print('built'), build(*given))\n"
        f"library, _ = load_library({SOURCE!r}, find_compiler(), {FLAGS!r}, ('answer',))\n"
        "print(library.answer())"
    )
    root = Path(__file__).parents[3]
    processes = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=root) for _ in range(2)
    ]
    assert sorted(process.communicate()[0].split() for process in processes) == [["42"], ["built", "42"]]
    assert len(list_libraries(cache)) == 1


def test_a_compiler_that_is_not_there_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler -fast")
    assert find_compiler().command[0] != "no-such-compiler"
    monkeypatch.setattr(compiler_module, "COMMON_NAMES", ())
    monkeypatch.setitem(sys.modules, "ziglang", None)
    monkeypatch.setenv("CC", "")
    compiler_module._find.cache_clear()
    with pytest.raises(CompilerError, match="no C\\+\\+ compiler \\(no-such-compiler: not found\\); to get a compiler"):
        find_compiler()
    compiler_module._find.cache_clear()
