"""What the records of a study say: verdicts, statistics and comparisons, as tables of plain data."""
