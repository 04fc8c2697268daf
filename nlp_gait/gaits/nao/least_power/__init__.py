"""Proofs of the least power of NAO's phases: the problem in other variables, with narrow bounds over boxes.

Read ``power_form.py`` (the variables, the rows and the cost), ``power_instants.py`` (one sample of either phase) and
``world_frame.py`` (dynamics in world coordinates). ``nlp_gait.proofs`` uses the result, a ``PowerForm``, without knowing NAO.
"""
