"""Plan again within milliseconds: steps of sequential quadratic programming on a problem's NLP."""
