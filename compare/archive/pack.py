"""A study as one ZIP file: with everything needed to check and to repeat it."""

import hashlib
import json
import os
import tempfile
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import distributions
from importlib.resources import files
from pathlib import Path

import nlp_gait
from compare.archive.unpack import MANIFEST, ArchiveManifest, unpack_archive
from compare.study.origin import format_now, hash_installed_code
from compare.study.record import RunRecord
from compare.study.record_files import locate_record
from compare.study.references import find_reference
from compare.study.settings import FILE, Manifest, read_manifest
from compare.study.task import SOURCE
from nlp_gait.backends.identity import FILES
from nlp_gait.errors import InputError
from nlp_gait.files import read_bytes, replace_file
from nlp_gait.proofs.certificate import CERTIFICATES, load_certificates
from nlp_gait.robots import load_robot
from nlp_gait.robots.loading import list_robot_files
from nlp_gait.robots.packages import find_robot_file
from nlp_gait.user_code import Kind, hash_source, is_user_code, list_source_files, resolve_code

README, LOCK = "README.md", "requirements.txt"
# Files of a study's folder next to its records; everything else in it stays out of the archive.
PARTS = (FILE, "*.html", "*.md", "*.png", "*.svg", "*.csv", "*.tex", "*.pdf", "better-*.json", "store/simulations/**/*")
EPOCH = (1980, 1, 1, 0, 0, 0)  # time of all entries, so that equal studies give equal archives


def pack_study(folder: Path, records: Sequence[RunRecord], out: Path) -> Path:
    """Write the archive of a study whose records were checked, and return it.

    Raises:
        InputError: a file cannot be read, or user code has changed since.
        UserCodeError: user code took part that the command does not name.
        OutputError: the archive cannot be written.
    """
    paths = (path for pattern in PARTS for path in sorted(folder.glob(pattern)) if path.is_file())
    content = {
        path.relative_to(folder).as_posix(): read_bytes(path, "file of the study")
        for path in (*(locate_record(folder, record) for record in records), *paths)
    }
    options = (record.inputs.problem for record in records)
    texts = {str(problem["options"][option]) for problem in options for option in problem.get(FILES, ())}
    robots = {text: _collect_robot(text, content) for text in sorted(texts)}
    _collect_code(records, content)
    _collect_certificates(records, content)
    manifest = read_manifest(folder)
    content[LOCK] = "".join(f"{line}\n" for line in _list_packages()).encode()
    content[README] = _make_readme(records, manifest, content).encode()
    write_archive(out, content, robots)
    return out


def write_archive(out: Path, content: dict[str, bytes], robots: Mapping[str, str]) -> None:
    """Write files and their manifest, and check that they can be unpacked; raises as ``pack_study``."""
    manifest = ArchiveManifest(
        schema=1,
        created=format_now(),
        version=nlp_gait.__version__,
        code_sha256=hash_installed_code(),
        robots=robots,
        files={name: hashlib.sha256(data).hexdigest() for name, data in content.items()},
    )
    content[MANIFEST] = (json.dumps(asdict(manifest), indent=1, sort_keys=True) + "\n").encode()
    with replace_file(out) as temporary:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in sorted(content.items()):
                entry = zipfile.ZipInfo(name, EPOCH)
                entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(entry, data)
        _check_archive(Path(temporary), robots)


def _collect_robot(text: str, content: dict[str, bytes]) -> str:
    """Add all files of a robot, at the same places relative to each other, and return its archived name."""
    name, mark, changes = text.partition("@")  # changes of masses and lengths
    source = find_robot_file(name)
    files = list_robot_files(source)
    # The name of the folder that contains them all is kept: ``package://`` finds meshes by it.
    top = Path(os.path.commonpath([os.path.dirname(file) for file in files])).parent
    place = f"robots/{hashlib.sha256(text.encode()).hexdigest()[:8]}"
    names = {file: f"{place}/{Path(file).relative_to(top).as_posix()}" for file in (*files, os.path.abspath(source))}
    content.update({names[file]: read_bytes(Path(file), "robot file") for file in files})
    return f"{names[os.path.abspath(source)]}{mark}{changes}"


def _check_archive(path: Path, robots: Mapping[str, str]) -> None:
    """Unpack an archive and require that its robots are the same and need no other files."""
    with tempfile.TemporaryDirectory() as folder:
        unpack_archive(path, Path(folder))
        for text, place in robots.items():
            packed = os.path.join(folder, place)
            needs = [file for file in list_robot_files(packed) if not file.startswith(folder + os.sep)]
            if needs or asdict(load_robot(packed)) != asdict(load_robot(text)):
                raise InputError(
                    f"robot {text!r} cannot be archived: its copy {f'needs {min(needs)!r}' if needs else 'is another robot'}; "
                    "name extended and included files and meshes by paths relative to the robot file"
                )


def _collect_code(records: Sequence[RunRecord], content: dict[str, bytes]) -> None:
    """Add user-defined problems and solvers, with the files next to them that they import."""
    for record in records:
        problem, solver = record.inputs.problem, record.inputs.solver
        code: list[tuple[Kind, str]] = []
        if is_user_code(problem["name"], "problem"):  # whose probes were compared
            code.append(("problem", resolve_code(problem["name"], "problem", "the study")))
        if isinstance(solver, Mapping) and {SOURCE, "name"} <= solver.keys():
            name = resolve_code(solver["name"], "algorithm", "the study")
            if hash_source(name, "algorithm") != solver[SOURCE]:
                raise InputError(f"{name!r} has changed since the study; restore it, or rerun the study")
            code.append(("algorithm", name))
        for kind, name in code:
            for path in list_source_files(name, kind):
                content[f"code/{path.name}"] = read_bytes(path, "code")


def _collect_certificates(records: Sequence[RunRecord], content: dict[str, bytes]) -> None:
    proven = {find_reference(record.inputs.problem).proven_as for record in records}
    for name in load_certificates():
        if name in proven:
            content[f"certificates/{name}.json"] = read_bytes(CERTIFICATES / f"{name}.json", "certificate")


def _list_packages() -> list[str]:
    names = {d.metadata["Name"]: d.version for d in distributions() if d.metadata["Name"]}
    names.pop("nlp-gait", None)  # it comes from a clone
    return sorted((f"{name}=={number}" for name, number in names.items()), key=str.lower)


def _make_readme(records: Sequence[RunRecord], manifest: Manifest, content: Iterable[str]) -> str:
    commands = "\n".join(f"    {session.command}" for session in manifest.sessions) or "    (not recorded)"
    code = (
        " User code is in `code/`: read it, unpack it, and name it by `--code FILE.py:NAME`; it runs only then."
        if any(name.startswith("code/") for name in content)
        else ""
    )
    template = files("compare.archive").joinpath("readme.md").read_text(encoding="utf-8")
    problems, solvers = (sorted({getattr(r, key) for r in records}) for key in ("problem", "solver"))
    title = f"{len(records)} runs of {', '.join(solvers)} on {', '.join(problems)}"
    facts = {"version": nlp_gait.__version__, "sha": hash_installed_code()[:8]}
    return template.format(title=title, commands=commands, code=code, **facts)
