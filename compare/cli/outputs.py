"""Files that the user names for output: an existing one is not replaced, unless with --force."""

from pathlib import Path

from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import check_output, check_output_name, is_forced, make_writable_folder


def check_output_file(path: Path) -> Path:
    """Check before the work that a file can be written and does not exist, and return its path; raises OutputError."""
    check_output_name(path)
    check_output(path)
    make_writable_folder(path.parent)
    try:
        if path.is_dir():
            raise InputError(f"{str(path)!r} is a folder; name a file")
        if path.is_file() and not is_forced():
            raise OutputError(f"cannot write {str(path)!r}: it exists; name another file, or give --force")
    except OSError as error:  # its name is too long
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
    return path
