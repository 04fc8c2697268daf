"""Time histories as a NumPy archive."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nlp_gait.errors import OutputError
from nlp_gait.problems.gait_problem import Signals


def write_npz(path: Path, signals: Signals) -> None:
    """Write all arrays and the joint names (columns of q, qd, qdd and tau) to one ``.npz`` file.

    Raises:
        OutputError: the file cannot be written.
    """
    temporary = path.with_name(f".{path.name}.tmp.npz")
    try:
        np.savez(temporary, allow_pickle=False, joints=np.array(signals.joints), **signals.arrays)
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
