"""Gupta, Pratihar, Deb (2023): NAO's single and double support."""
