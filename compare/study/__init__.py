"""Runs of solvers on problems: what to run, running it, and the records that stay."""
