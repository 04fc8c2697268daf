"""Gupta, Pratihar, Deb (2023): NAO's single and double support, and what they leave open."""
