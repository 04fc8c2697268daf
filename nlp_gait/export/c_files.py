"""C and C++ files from templates, for exported objectives and solvers."""

from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path

from nlp_gait.files import check_output, make_writable_folder, write_text


def write_c_files(
    folder: Path, package: str, templates: Mapping[str, str], words: Mapping[str, str], source: str, force: bool
) -> list[Path]:
    """Write a C++ source and the files from templates; return their paths, the source's first.

    Args:
        folder: created if missing.
        package: with the templates in its folder ``native``.
        templates: by the name of the file, in which ``{prefix}`` is replaced by the word PREFIX.
        words: replacement of each ``@WORD@`` in the templates.
        source: of ``{prefix}.cpp``.
        force: whether existing files are replaced.

    Raises:
        OutputError: the folder cannot be written to, or has a file under one of the names.
    """
    native, prefix = files(package) / "native", words["PREFIX"]
    texts = {f"{prefix}.cpp": source}
    for name, template in templates.items():
        text = (native / template).read_text(encoding="utf-8")
        for word, value in words.items():
            text = text.replace(f"@{word}@", value)
        texts[name.format(prefix=prefix)] = text
    paths = {make_writable_folder(folder) / name: text for name, text in texts.items()}
    for path in paths:
        check_output(path, force)
    for path, text in paths.items():
        write_text(path, text)
    return list(paths)


def format_comment(lines: Iterable[str]) -> str:
    """Return lines for an open comment of C."""
    return "\n".join(f" *   {line}".replace("*/", "* /") for line in lines)
