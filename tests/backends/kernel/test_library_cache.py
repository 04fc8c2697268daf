"""The compiler and its cache: what is broken, hangs, cannot be written or happens twice at once."""

from __future__ import annotations

import functools
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from nlp_gait.backends.kernel import compiler as compiler_module
from nlp_gait.backends.kernel import library_cache
from nlp_gait.backends.kernel.compiler import Compiler, find_compiler
from nlp_gait.backends.kernel.library_cache import find_cache_folder, load_library
from nlp_gait.errors import CompilerError

SOURCE = 'extern "C" int answer(void) { return 42; }\n'
FLAGS = ("-O0",)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    private = tmp_path / "private"
    private.mkdir()
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(library_cache, "make_private_folder", functools.cache(lambda: private))
    library_cache.warn_once.cache_clear()
    return folder


@pytest.fixture
def compiler() -> Compiler:
    return find_compiler()


def answer(compiler: Compiler) -> tuple[int, Path]:
    library, path = load_library(SOURCE, compiler, FLAGS, ("answer",))
    return library.answer(), path


def script(folder: Path, body: str) -> str:
    """A compiler that is a shell script and answers ``--version``."""
    path = folder / "compiler.sh"
    path.write_text(f'#!/bin/sh\nif [ "$1" = --version ]; then echo "script 1"; exit 0; fi\n{body}\n', encoding="ascii")
    path.chmod(0o700)
    return str(path)


def test_a_library_is_built_once(cache: Path, compiler: Compiler, monkeypatch: pytest.MonkeyPatch) -> None:
    value, path = answer(compiler)
    assert value == 42 and path.parent == cache
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700
    assert list(cache.iterdir()) == [path]
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
    assert [library_cache.load_if_valid(file, ("answer",)) is not None for file in cache.iterdir()] == [True]


def test_a_library_without_the_function_is_not_trusted(cache: Path, compiler: Compiler) -> None:
    with pytest.raises(CompilerError, match="cannot be loaded"):
        load_library(SOURCE, compiler, FLAGS, ("question",))


def test_a_link_in_place_of_a_library_is_not_followed(cache: Path, compiler: Compiler, tmp_path: Path) -> None:
    _, path = answer(compiler)
    elsewhere = tmp_path / path.name
    path.rename(elsewhere)
    path.symlink_to(elsewhere)
    assert answer(compiler)[0] == 42
    assert elsewhere.exists() and not path.is_symlink()


def test_source_and_flags_make_the_key(cache: Path, compiler: Compiler) -> None:
    paths = {
        load_library(source, compiler, flags, ())[1]
        for source in (SOURCE, SOURCE + "\n")
        for flags in (FLAGS, ("-O1",))
    }
    assert len(paths) == 4


def test_a_cache_that_cannot_be_made_or_trusted(
    cache: Path, compiler: Compiler, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    target = tmp_path / "somewhere"
    target.mkdir()
    for make in (lambda: cache.write_text("a file"), lambda: cache.symlink_to(target), lambda: _open_to_all(cache)):
        make()
        caplog.clear()
        library_cache.warn_once.cache_clear()
        assert answer(compiler)[0] == 42
        assert find_cache_folder() != cache
        assert len(caplog.messages) == 1 and "cannot be used" in caplog.messages[0]
        assert not any(target.iterdir())
        cache.rmdir() if cache.is_dir() and not cache.is_symlink() else cache.unlink()


def _open_to_all(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)


def test_a_full_or_read_only_cache_costs_one_line(
    cache: Path, compiler: Compiler, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    replace = os.replace

    def refuse(source: Path, target: Path) -> None:
        if target.parent == cache:
            raise OSError("No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", refuse)
    value, path = answer(compiler)
    assert value == 42 and path.parent != cache
    assert not any(cache.iterdir())
    assert len(caplog.messages) == 1 and "No space left on device" in caplog.messages[0]


def test_two_processes_at_once_end_with_good_libraries(cache: Path) -> None:
    code = (
        "from nlp_gait.backends.kernel.library_cache import load_library\n"
        "from nlp_gait.backends.kernel.compiler import find_compiler\n"
        f"library, _ = load_library({SOURCE!r}, find_compiler(), {FLAGS!r}, ('answer',))\n"
        "print(library.answer())"
    )
    root = Path(__file__).parents[3]
    processes = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=root) for _ in range(2)
    ]
    assert [process.communicate()[0].strip() for process in processes] == ["42", "42"]
    assert all(library_cache.load_if_valid(file, ("answer",)) is not None for file in cache.iterdir())


def test_a_compiler_that_fails_says_why(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", script(tmp_path, "echo 'kernel.cpp:1: error: no such thing' >&2; exit 3"))
    with pytest.raises(
        CompilerError, match=r"compiler.sh failed with exit status 3: kernel.cpp:1: error: no such thing"
    ):
        answer(find_compiler())


def test_a_compiler_that_hangs_is_ended(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", script(tmp_path, "sleep 60 & sleep 60"))
    monkeypatch.setattr(compiler_module, "TIME_LIMIT_S", 0.3)
    with pytest.raises(CompilerError, match=r"compiler.sh did not end within 0.3 s"):
        answer(find_compiler())


def test_a_compiler_that_is_not_there_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler -fast")
    assert find_compiler().command[0] != "no-such-compiler"
    monkeypatch.setattr(compiler_module, "COMMON_NAMES", ())
    monkeypatch.setattr(compiler_module, "find_spec", lambda name: None)
    monkeypatch.setenv("CC", "")
    compiler_module._find.cache_clear()
    with pytest.raises(CompilerError, match="no C\\+\\+ compiler \\(no-such-compiler: not found\\); to get a compiler"):
        find_compiler()
    compiler_module._find.cache_clear()
