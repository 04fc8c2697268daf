"""Statistics of records: pure functions of arrays and plain data, each with its source."""
