"""Is the best known optimum the global one? Many starts, and a proof by branch and bound."""
