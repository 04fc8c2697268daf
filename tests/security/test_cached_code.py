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

SOURCE = 'extern "C" int answer(void) { return 42; }\n'


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder, private = tmp_path / "cache", tmp_path / "private"
    private.mkdir(mode=0o700)
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(library_cache, "private_folder", functools.cache(lambda: private))
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
