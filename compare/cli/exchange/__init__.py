"""Commands that bring results from elsewhere, and take problems and runs there: imports, logs, the C export, the leaderboard."""
