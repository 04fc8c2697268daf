"""Entry point of the console script, which handles Ctrl-C before it imports the command line."""

import gc
import os
import sys

from nlp_gait.errors import describe_shortage
from nlp_gait.interrupts import exit_on_interrupt
from nlp_gait.processes import kill_children


def fix_environment() -> None:
    """Replace values with which libraries fail or print nothing: no width of the terminal, an unknown backend of matplotlib."""
    width = os.environ.get("COLUMNS", "1")
    if not (width.isascii() and width.isdigit() and int(width) > 0):
        del os.environ["COLUMNS"]
    os.environ["MPLBACKEND"] = "agg"  # figures are only written to files


def main() -> None:
    """Run the command line."""
    try:
        os.getcwd()
    except FileNotFoundError:
        sys.exit("nlp-gait: the working folder does not exist any more; change to another one")
    exit_on_interrupt()
    fix_environment()
    try:
        gc.disable()  # while modules are imported, every collection would find nothing
        from compare.cli import main as run

        gc.freeze()  # what was imported stays to the end
        gc.enable()
        run()
    except Exception as error:
        shortage = describe_shortage(error)
        if shortage is None:
            raise
        kill_children()
        sys.stderr.write(f"nlp-gait: {shortage}; finished results are stored, see ulimit -a or use fewer --jobs\n")
        sys.exit(1)


if __name__ == "__main__":
    main()
