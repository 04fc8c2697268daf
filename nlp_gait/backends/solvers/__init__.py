"""The lifted NLP given to IPOPT and to the other solvers of the CasADi wheel."""
