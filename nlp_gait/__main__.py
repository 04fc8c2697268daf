"""``python -m nlp_gait`` is the console script."""

from compare.cli import main

main()
