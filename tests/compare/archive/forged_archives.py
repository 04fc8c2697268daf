"""Damaged and forged archives of a study, each made from the files of an honest one."""

import hashlib
import io
import json
import stat
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

Files = dict[str, bytes]

MANIFEST = "manifest.json"


def write_zip(files: Mapping[str, bytes], change: Callable[[zipfile.ZipInfo], None] = lambda entry: None) -> bytes:
    """Return an archive of files; ``change`` edits the entry of each."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)
            entry.compress_type = zipfile.ZIP_DEFLATED
            change(entry)
            archive.writestr(entry, data)
    return stream.getvalue()


def sign(files: Files) -> Files:
    """Return files whose manifest has their hashes, as a careful forger leaves it."""
    manifest = json.loads(files[MANIFEST])
    rest = {name: data for name, data in files.items() if name != MANIFEST}
    manifest["files"] = {name: hashlib.sha256(data).hexdigest() for name, data in rest.items()}
    return {**rest, MANIFEST: json.dumps(manifest).encode()}


def edit(files: Files, name: str, change: Callable[[dict], object]) -> Files:
    """Return signed files of which one JSON file was edited."""
    raw = json.loads(files[name])
    change(raw)
    return sign({**files, name: json.dumps(raw).encode()})


def change_places(raw: dict[str, Any], changes: Iterable[tuple[str, Any]]) -> None:
    """Change places of plain data, keys separated by dots, to a value or by a function of the present one."""
    for place, value in changes:
        *above, last = [int(key) if key.lstrip("-").isdigit() else key for key in place.split(".")]
        parent: Any = raw
        for key in above:
            parent = parent[key]
        parent[last] = value(parent[last]) if callable(value) else value


def damage(files: Files, record: str) -> Iterator[tuple[str, bytes, str]]:
    """Yield archives that cannot be unpacked or differ from their manifest: name, bytes, and the word that must be named."""
    whole = write_zip(files)
    yield "no archive", b"not a zip", "damaged"
    yield "half an archive", whole[: len(whole) // 2], "damaged"
    yield "a flipped byte", _flip(whole, record), "damaged"
    yield "no manifest", write_zip({n: d for n, d in files.items() if n != MANIFEST}), MANIFEST
    yield "a manifest that is no JSON", write_zip({**files, MANIFEST: b"{"}), "manifest"
    yield "a manifest of the future", write_zip({**files, MANIFEST: b'{"schema": 9}'}), "manifest"
    yield "a file less", write_zip({n: d for n, d in files.items() if n != record}), f"{record} is missing"
    yield "a file more", write_zip({**files, "more.txt": b"x"}), "more.txt is not in the manifest"
    yield (
        "an edited record",
        write_zip({**files, record: files[record].replace(b"true", b"false", 1)}),
        f"{record} differs",
    )
    for bad in (
        "../outside.txt",
        "/outside.txt",
        "a/../../outside.txt",
        "C:outside.txt",
        "a\\..\\outside.txt",
        "a//b",
        "x\ny",
    ):
        yield (
            f"a file called {bad!r}",
            write_zip({**files, bad: b"x"}),
            "outside" if "outside" in bad else "not allowed",
        )
    yield "two names that differ in case", write_zip({**files, record.upper(): b"x"}), "twice"
    yield "a link", write_zip({**files, "link": b"/etc/passwd"}, _make_link), "plain file"
    yield "a folder", write_zip({**files, "folder/": b""}), "folder/"
    yield "a bomb", write_zip({**files, "bomb": b"0" * 30_000_000}), "too large"


def forge(files: Files, record: str) -> Iterator[tuple[str, bytes, str]]:
    """Yield archives whose manifest fits, but whose content does not hold: name, bytes, and the word that must be named."""
    study = "study.json"
    yield (
        "a better record",
        write_zip(edit(files, record, lambda r: r["verdict"].update(objective=0.95))),
        "its objective",
    )
    yield "no sessions", write_zip(edit(files, study, lambda r: r.update(sessions=[]))), study
    yield "other code", write_zip(edit(files, study, lambda r: r["sessions"][0]["versions"].update(code="0"))), study
    yield (
        "another machine",
        write_zip(edit(files, study, lambda r: r["sessions"][0]["machine"].update(processor="x"))),
        study,
    )
    yield "a later start", write_zip(edit(files, study, lambda r: r["sessions"][0].update(started="2999-01-01"))), study
    robots = edit(files, MANIFEST, lambda r: r.update(robots={"my.json": "../../my.json"}))
    yield "a robot file outside", write_zip(robots), "my.json"
    yield "a damaged study file", write_zip(sign({**files, study: b"[]"})), study
    name = next(name for name in files if name.startswith("certificates/"))
    better = edit(files, name, lambda r: r["certificate"].update(bound=r["certificate"]["objective"]))
    yield "a certificate of a tighter bound", write_zip(better), name
    yield "a certificate without content", write_zip(sign({**files, name: b"{}"})), name


def _flip(whole: bytes, record: str) -> bytes:
    at = whole.index(record.encode()) + len(record) + 40  # in the compressed content
    return whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :]


def _make_link(entry: zipfile.ZipInfo) -> None:
    if entry.filename == "link":
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
