"""Gupta, Pratihar, Deb (2025): power against stability of NAO in both phases, four algorithms against the true front."""
