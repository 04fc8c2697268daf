"""Run all notebooks of the gallery under Jupyter, each in an empty folder: ``python -m benchmarks.notebooks [NAME...]``.

Needs the extras docs, notebook and test. Prints the figures that each shows and its seconds; ends with status 1 if one fails or
shows no figure.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from nbclient.exceptions import CellExecutionError

from docs.pages.gallery import ORDER, make_notebook, run_notebook

EXAMPLES = Path(__file__).parents[1] / "examples"


def main() -> None:
    """Run the notebooks named, or all."""
    failed = []
    for name in sys.argv[1:] or ORDER:
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            try:
                _, figures = run_notebook(make_notebook(EXAMPLES / name), Path(folder))
                found = f"{figures} figures"
            except CellExecutionError as error:
                figures, found = 0, str(error)
        print(f"{name}: {found}, {time.perf_counter() - start:.1f} s", flush=True)
        failed += [name] if figures == 0 else []
    sys.exit(f"no figure: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
