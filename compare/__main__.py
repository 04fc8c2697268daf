"""Entry point of the console script, which imports the command line once Ctrl-C is taken care of."""

from compare.starting import end_at_interrupts


def main() -> None:
    """Run the command line."""
    end_at_interrupts()
    from compare.cli import main as run

    run()


if __name__ == "__main__":
    main()
