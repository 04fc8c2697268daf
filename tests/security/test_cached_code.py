"""Compiled code is loaded only if no other user can have written it."""

from __future__ import annotations

import functools
import os
import stat
from pathlib import Path

import pytest

from nlp_gait.backends.kernel import library_cache
from nlp_gait.backends.kernel.compiler import find_compiler
from nlp_gait.backends.kernel.library_cache import find_cache_folder, load_library
from tests.faults.processes import in_own_mounts

SOURCE = 'extern "C" int answer(void) { return 42; }\n'


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder, private = tmp_path / "cache", tmp_path / "private"
    private.mkdir(mode=0o700)
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(library_cache, "make_private_folder", functools.cache(lambda: private))
    library_cache.warn_once.cache_clear()
    return folder


def built() -> Path:
    library, path = load_library(SOURCE, find_compiler(), ("-O0",), ("answer",))
    assert library.answer() == 42
    return path


def test_permissions_are_safe_whatever_the_mask(cache: Path) -> None:
    before = os.umask(0)
    try:
        library = built()
    finally:
        os.umask(before)
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700
    assert stat.S_IMODE(library.stat().st_mode) == 0o600


@pytest.mark.parametrize("mode", [0o620, 0o602])
def test_a_library_that_others_may_write_is_rebuilt(cache: Path, mode: int) -> None:
    library = built()
    library.chmod(mode)
    assert stat.S_IMODE(built().stat().st_mode) == 0o600


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs two users, and only root is several")
def test_a_library_or_folder_of_another_user_is_not_used(cache: Path) -> None:
    library = built()
    os.chown(library, 12345, -1)
    assert built().stat().st_uid == os.getuid()
    os.chown(cache, 12345, -1)
    assert find_cache_folder() != cache
    assert built().parent != cache


def test_a_folder_that_is_a_link_or_open_to_others_is_not_used(cache: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    cache.symlink_to(tmp_path / "elsewhere")
    assert find_cache_folder() != cache
    assert built().parent != cache and not list((tmp_path / "elsewhere").iterdir())
    cache.unlink()
    cache.mkdir()
    cache.chmod(0o777)
    assert find_cache_folder() != cache


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
    library = built()
    hostile = tmp_path / "hostile.so"
    find_compiler().build(_write(tmp_path / "hostile.cpp", SOURCE.replace("42", "13")), hostile, ())
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


def _write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


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
