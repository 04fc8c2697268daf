"""Limits at all times: rigorous enclosures of every row over intervals of time, for a given gait.

A problem states its rows at samples. Here each is a function of time, enclosed over pieces of the motion by affine arithmetic
along time; a piece that does not show that all rows hold is halved. What is shown holds at every instant, in exact arithmetic,
to the judge's tolerance.

Source:
    The question is that of Lengagne, Ramdani, Fraisse (2011), Planning and fast replanning safe motions for humanoid robots;
    affine forms in place of their polynomials.
"""
