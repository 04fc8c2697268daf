"""``python -m nlp_gait`` is the console script."""

from nlp_gait.cli import main

main()
