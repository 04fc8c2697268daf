"""Optima in detail: first-order conditions, derivatives with respect to parameters, following an optimum."""
