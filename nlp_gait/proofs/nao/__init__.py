"""Least power of NAO's phases in other variables, with narrow bounds over boxes.

Read ``phases.py`` (the variables, the rows and the cost), ``instants.py`` (one sample of either phase) and ``world_frame.py``
(dynamics in world coordinates).
"""
