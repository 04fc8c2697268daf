"""IPOPT and other NLP solvers."""
