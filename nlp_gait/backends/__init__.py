"""A problem as an NLP for IPOPT, and as compiled code for search algorithms."""
