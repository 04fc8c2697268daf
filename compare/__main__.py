"""Entry point of the console script, which handles Ctrl-C before it imports the command line."""

from nlp_gait.interrupts import exit_on_interrupt
from nlp_gait.working_folder import hide_working_folder


def main() -> None:
    """Run the command line."""
    exit_on_interrupt()
    hide_working_folder()
    from compare.cli import main as run

    run()


if __name__ == "__main__":
    main()
