"""Time histories as a NumPy archive."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nlp_gait.files import new_file
from nlp_gait.problem import Signals


def write_npz(path: Path, signals: Signals) -> None:
    """Write all arrays and the joint names (columns of q, qd, qdd and tau) to one ``.npz`` file.

    Raises:
        OutputError: the file cannot be written.
    """
    with new_file(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, allow_pickle=False, joints=np.array(signals.joints), **signals.arrays)
