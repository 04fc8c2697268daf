"""Motions that are given as angles over time: places, phases, limits, and the cycle that is judged by a planned one's."""
