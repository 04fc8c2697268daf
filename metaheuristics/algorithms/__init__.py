"""The search algorithms of this package; each file has the settings of one, its formulas, and its run."""
