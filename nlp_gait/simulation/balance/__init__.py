"""Balance feedback of planned walks, a `Corrector` of simulations."""
