"""The seed papers' tables and figures, next to ours."""
