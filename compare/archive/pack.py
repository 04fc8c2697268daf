"""A study as one ZIP file: with everything needed to check and to repeat it."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import distributions, version
from importlib.resources import files
from pathlib import Path
from typing import Any

from compare.study.manifest import FILE, Manifest, read_manifest
from compare.study.origin import format_now, hash_installed_code
from compare.study.record import RunRecord
from compare.study.record_files import RECORDS
from nlp_gait.backends.identity import FILES, HASH, SOURCE
from nlp_gait.errors import InputError
from nlp_gait.files import make_file_name, read_bytes, replace_file
from nlp_gait.proofs.certificate import CERTIFICATES, load_certificates
from nlp_gait.user_code import Kind, hash_source, list_source_files, resolve_code

MANIFEST, README, LOCK, CRATE = "manifest.json", "README.md", "requirements.txt", "ro-crate-metadata.json"
SCHEMA = 1
# Files of a study's folder next to its records; everything else in it stays out of the archive.
PARTS = (FILE, "*.html", "*.md", "*.png", "*.svg", "*.csv", "better-*.json", "store/simulations/**/*")
EPOCH = (1980, 1, 1, 0, 0, 0)  # time of all entries, so that equal studies give equal archives
LICENSE = "not stated; ask the authors of the study"


def pack_study(folder: Path, records: Sequence[RunRecord], out: Path) -> Path:
    """Write the archive of a study whose records were checked, and return it.

    Raises:
        InputError: a file cannot be read, or user code has changed since.
        UserCodeError: user code took part that the command does not name.
        OutputError: the archive cannot be written.
    """
    content = {
        path.relative_to(folder).as_posix(): read_bytes(path, "file of the study")
        for pattern in (f"{RECORDS}/*/*.json", *PARTS)
        for path in sorted(folder.glob(pattern))
        if path.is_file()
    }
    robots = _collect_robots(records, content)
    _collect_code(records, content)
    _collect_certificates(records, content)
    manifest = read_manifest(folder)
    content[LOCK] = "".join(f"{line}\n" for line in _list_packages()).encode()
    content[README] = _make_readme(records, manifest, content).encode()
    content[CRATE] = _to_bytes(_make_crate(records, content))
    content[MANIFEST] = _to_bytes(
        {
            "schema": SCHEMA,
            "created": format_now(),
            "version": version("nlp-gait"),
            "code_sha256": hash_installed_code(),
            "robots": robots,
            "files": {name: hashlib.sha256(data).hexdigest() for name, data in sorted(content.items())},
        }
    )
    with replace_file(out) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(content.items()):
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return out


def _to_bytes(data: Any) -> bytes:
    return (json.dumps(data, indent=1, sort_keys=True) + "\n").encode()


def _collect_robots(records: Sequence[RunRecord], content: dict[str, bytes]) -> dict[str, str]:
    """Add the files that options of problems name, and those of the same stem; return the archived name of each."""
    found: dict[str, str] = {}
    for record in records:
        problem = record.definition["problem"]
        for text in (str(problem["options"][option]) for option in problem.get(FILES, ())):
            if text in found:
                continue
            source, mark, changes = text.partition("@")  # changes of masses and lengths
            path = Path(source)
            place = f"robots/{hashlib.sha256(text.encode()).hexdigest()[:8]}"
            for file in sorted({path, *path.parent.glob(f"{path.stem}.*")}):
                if file.suffix in (".json", ".urdf", ".xml"):
                    content[f"{place}/{file.name}"] = read_bytes(file, "robot file")
            found[text] = f"{place}/{path.name}{mark}{changes}"
    return found


def _collect_code(records: Sequence[RunRecord], content: dict[str, bytes]) -> None:
    """Add user-defined problems and solvers, with the files next to them that they import."""
    for record in records:
        solver = record.definition["solver"]
        for part in (record.definition["problem"], solver if isinstance(solver, Mapping) else {}):
            if SOURCE in part and "name" in part:
                kind: Kind = "algorithm" if part is solver else "problem"
                name = resolve_code(part["name"], kind, "the study")
                if hash_source(name, kind) != part[SOURCE]:
                    raise InputError(f"{name!r} has changed since the study; restore it, or rerun the study")
                for path in list_source_files(name, kind):
                    content[f"code/{path.name}"] = read_bytes(path, "code")


def _collect_certificates(records: Sequence[RunRecord], content: dict[str, bytes]) -> None:
    known = {record.definition["problem"].get(HASH) for record in records}
    for name, file in load_certificates().items():
        if file.problem[HASH] in known:
            content[f"certificates/{name}.json"] = read_bytes(CERTIFICATES / f"{name}.json", "certificate")


def _list_packages() -> list[str]:
    names = {d.metadata["Name"]: d.version for d in distributions() if d.metadata["Name"]}
    return sorted((f"{name}=={number}" for name, number in names.items()), key=str.lower)


def _describe(records: Sequence[RunRecord]) -> str:
    problems, solvers = (sorted({getattr(r, key) for r in records}) for key in ("problem", "solver"))
    return f"{len(records)} runs of {', '.join(solvers)} on {', '.join(problems)}"


def _make_readme(records: Sequence[RunRecord], manifest: Manifest, content: Iterable[str]) -> str:
    template = files("compare.archive").joinpath("readme.md").read_text(encoding="utf-8")
    commands = "\n".join(f"    {session.command}" for session in manifest.sessions) or "    (not recorded)"
    code = (
        " User code is in `code/`: read it, unpack it, and name it by `--code FILE.py:NAME`; it runs only then."
        if any(name.startswith("code/") for name in content)
        else ""
    )
    return template.format(title=_describe(records), version=version("nlp-gait"), commands=commands, code=code)


def _make_crate(records: Sequence[RunRecord], content: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the metadata of an RO-Crate 1.1 (https://w3id.org/ro/crate/1.1): a root data set and its files."""
    names = [name for name in sorted(content) if name != CRATE]
    entities = [{"@id": name, "@type": "File", "contentSize": str(len(content[name]))} for name in names]
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": f"Study of nlp-gait on {', '.join(make_file_name(p) for p in sorted({r.problem for r in records}))}",
        "description": _describe(records),
        "datePublished": format_now()[:10],
        "license": LICENSE,
        "hasPart": [{"@id": name} for name in names],
    }
    descriptor = {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
        "about": {"@id": "./"},
    }
    return {"@context": "https://w3id.org/ro/crate/1.1/context", "@graph": [descriptor, root, *entities]}
