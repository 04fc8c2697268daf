"""The cache of compiled code: broken, not writable, shared, or written to by another user."""

import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from threadpoolctl import ThreadpoolController

from nlp_gait.backends.kernel import compiler as compiler_module
from nlp_gait.backends.kernel import library_cache
from nlp_gait.backends.kernel.compiler import Compiler, find_compiler
from nlp_gait.backends.kernel.library_cache import find_cache_folder, load_library
from nlp_gait.errors import CompilerError
from tests.faults.processes import in_own_mounts

SOURCE = 'extern "C" int answer(void) { return 42; }\n'
FLAGS = ("-O0",)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "cache"
    private = tmp_path / "private"
    private.mkdir(mode=0o700)
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(tempfile, "tempdir", str(private))
    library_cache.make_private_folder.cache_clear()
    library_cache.warn_once.cache_clear()
    yield folder
    library_cache.make_private_folder.cache_clear()


@pytest.fixture
def compiler() -> Compiler:
    return find_compiler()


def list_libraries(cache: Path) -> list[Path]:
    return sorted(cache.glob(f"*{library_cache.SUFFIX}"))


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
    assert [library_cache.load_if_valid(file, ("answer",)) is not None for file in list_libraries(cache)] == [True]


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


def test_a_folder_whose_name_is_not_text_has_no_library_that_threadpoolctl_cannot_name(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9"))
    library_cache.warn_once.cache_clear()
    assert answer(compiler)[0] == 42
    assert len(caplog.messages) == 1 and "its name is not valid UTF-8" in caplog.messages[0]
    assert ThreadpoolController().lib_controllers


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
    assert not list_libraries(cache)
    assert len(caplog.messages) == 1 and "No space left on device" in caplog.messages[0]


def test_of_two_processes_at_once_one_builds(cache: Path) -> None:
    code = (
        "from nlp_gait.backends.kernel.library_cache import load_library\n"
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
    (library,) = list_libraries(cache)
    assert library_cache.load_if_valid(library, ("answer",)) is not None


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


def test_permissions_are_safe_whatever_the_mask(cache: Path) -> None:
    before = os.umask(0)
    try:
        _, library = answer(find_compiler())
    finally:
        os.umask(before)
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700
    assert stat.S_IMODE(library.stat().st_mode) == 0o600


@pytest.mark.parametrize("mode", [0o620, 0o602])
def test_a_library_that_others_may_write_is_rebuilt(cache: Path, mode: int) -> None:
    library = answer(find_compiler())[1]
    library.chmod(mode)
    assert stat.S_IMODE(answer(find_compiler())[1].stat().st_mode) == 0o600


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs two users, and only root is several")
def test_a_library_or_folder_of_another_user_is_not_used(cache: Path) -> None:
    library = answer(find_compiler())[1]
    os.chown(library, 12345, -1)
    assert answer(find_compiler())[1].stat().st_uid == os.getuid()
    os.chown(cache, 12345, -1)
    assert find_cache_folder() != cache
    assert answer(find_compiler())[1].parent != cache


@pytest.mark.parametrize("mode", [0o777, 0o757, 0o775, 0o722])
@pytest.mark.parametrize("depth", [1, 2, 3])
def test_a_folder_that_others_may_exchange_is_not_used(
    mode: int, depth: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """One of its parents, above or below, may be written to by others; with the sticky bit only owners rename."""
    library_cache.warn_once.cache_clear()
    monkeypatch.setattr(library_cache, "make_private_folder", lambda: tmp_path)
    folder = tmp_path / "a" / "b" / "c" / "cache"
    folder.mkdir(parents=True, mode=0o700)
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    parent = folder.parents[depth - 1]
    parent.chmod(mode | stat.S_ISVTX)
    assert find_cache_folder() == folder
    parent.chmod(mode)
    assert find_cache_folder() == tmp_path
    assert len(caplog.messages) == 1 and f"they may write to {parent}; fix this" in caplog.messages[0]
    (tmp_path / "link").symlink_to(folder.parent)  # the folders that it leads to count
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(tmp_path / "link" / "cache"))
    assert find_cache_folder() == tmp_path


def test_parents_are_made_for_the_user_alone_whatever_the_mask(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = cache / "home" / ".cache" / "nlp-gait"
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    before = os.umask(0)
    try:
        assert find_cache_folder() == folder
    finally:
        os.umask(before)
    assert [stat.S_IMODE(made.stat().st_mode) for made in (folder, *folder.parents[:3])] == [0o700] * 4


@pytest.mark.parametrize("exchanged", ["folder", "parent"])
def test_a_library_that_is_exchanged_after_its_check_is_not_loaded(
    exchanged: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "parent" / "cache"
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    library = answer(find_compiler())[1]
    hostile = tmp_path / "hostile.so"
    (tmp_path / "hostile.cpp").write_text(SOURCE.replace("42", "13"))
    find_compiler().build(tmp_path / "hostile.cpp", hostile, ())
    check = library_cache._check_library

    def exchange_after(path: Path) -> str | None:
        name = check(path)
        moved = folder if exchanged == "folder" else folder.parent
        moved.rename(tmp_path / "moved")
        folder.mkdir(parents=True)
        hostile.rename(path)
        return name

    monkeypatch.setattr(library_cache, "_check_library", exchange_after)
    loaded = library_cache.load_if_valid(library, ("answer",))
    assert loaded is not None and loaded.answer() == 42 and library.exists()


@pytest.mark.slow
def test_a_mount_that_forbids_code_is_named_and_another_folder_used(tmp_path: Path) -> None:
    code = "from nlp_gait.backends.kernel.library_cache import find_cache_folder; print(find_cache_folder())"
    done = in_own_mounts(
        'chmod 700 "$2"; mount -t tmpfs -o noexec,mode=700 none "$2"; mkdir "$2/tmp"; export NLP_GAIT_CACHE="$2/cache" '
        f'TMPDIR="$2/tmp"; exec "$1" -c "{code}"',
        str(tmp_path),
    )
    assert done.returncode == 0 and not done.stdout.startswith(str(tmp_path)), done.stderr
    assert done.stderr.count("\n") == 1 and "its mount has the option noexec" in done.stderr
