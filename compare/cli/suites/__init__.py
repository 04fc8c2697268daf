"""Commands that take the suite and the runs elsewhere: the leaderboard, the plain C++ objective, other packages' logs."""
