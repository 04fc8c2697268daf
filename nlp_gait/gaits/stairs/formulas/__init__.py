"""Formulas of the stair biped: pure functions of symbols, as those in ``symbolic/``."""
