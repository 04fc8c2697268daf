"""Files that the user names for output: one of another program is not replaced, unless with --force."""

import re
from pathlib import Path

from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import check_output, check_path, is_forced, make_writable_folder

# What is in the first or last bytes of a file that a command wrote, by suffix.
OWN_CONTENT = {
    ".json": rb'\A\{\n "(schema": \d+,\n "(problem|kind|robot)|names": \[|header": \{\n  "frame_id)',
    ".csv": rb"\At_s,|\A[^\n]*,violation,feasible,feasible_between_samples,guaranteed",
    ".motion": rb"\A#WEBOTS_MOTION,V1\.0,",
    ".xml": rb'\A<mujoco model="[^"]*">\n  <compiler angle="radian" autolimits="true" />\n  <option integrator="implicitfast"',
    ".npz": rb"joints\.npy",
    ".zip": rb"manifest\.json",
    ".html": rb'<meta name="generator" content="nlp-gait">',
    ".gif": rb"\AGIF89a.*nlp-gait",
    ".png": rb"\A\x89PNG.*Matplotlib",
}
EXAMINED = 4096  # bytes at each end


def check_output_file(path: Path) -> Path:
    """Check before the work that a file can be written and, if it exists, replaced; return its path; raises OutputError."""
    check_path(str(path), f"cannot write to {str(path)!r}", OutputError)
    check_output(path)
    make_writable_folder(path.parent)
    try:
        if path.is_dir():
            raise InputError(f"{str(path)!r} is a folder; name a file")
        if path.is_file() and not is_forced() and not _is_own(path):
            raise OutputError(
                f"cannot write {str(path)!r}: it exists, and nlp-gait did not write it; name another file, or give --force"
            )
    except OSError as error:  # its name is too long, or it cannot be read
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
    return path


def _is_own(path: Path) -> bool:
    pattern = OWN_CONTENT.get(path.suffix.lower())
    content = path.read_bytes()
    return pattern is not None and bool(re.search(pattern, content[:EXAMINED] + content[-EXAMINED:], re.DOTALL))
