"""One kind of solver a file: from a task to its record."""
