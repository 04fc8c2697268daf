"""What breaks, on purpose: kills, fuzzing, mutants, threads and lost power, a command each (``docs/robustness.md``)."""
