"""How many edited submissions are rejected: ``python -m benchmarks.gaitbench.edits``.

One number of a record is edited in each copy of a submission, in every second copy with all hashes computed again; every copy is
verified with all its runs repeated.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from compare.bench.submission import pack_submission, verify_submission
from nlp_gait.errors import InputError
from tests.compare.bench.test_submission import edit, run


def main() -> None:
    """Print what was not rejected, and the count."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gaitbench.edits", description=__doc__.splitlines()[0])
    parser.add_argument("--copies", type=int, default=100)
    copies = parser.parse_args().copies
    rejected = 0
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        run(folder)
        submission = pack_submission(folder, folder / "submission.zip")
        for seed in range(copies):
            copy = folder / f"{seed}.zip"
            place = edit(submission, copy, 1000 + seed, rehash=seed % 2 == 0)
            try:
                found = verify_submission(copy, share=1.0)[0]
            except InputError:
                rejected += 1
                continue
            if all(f.holds for f in found):
                print(f"not rejected: {place}", flush=True)
            else:
                rejected += 1
    print(f"{rejected} of {copies} edited submissions rejected")


if __name__ == "__main__":
    main()
