"""Gupta, Pratihar, Deb (2023): NAO's single and double support, and a walking cycle.

Variables of both phases are in the paper's order, x1 to x9 and x1 to x8.
"""
