"""The walking cycle: planned by its optimum, or by the textbook."""
