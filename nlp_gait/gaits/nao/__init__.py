"""Gupta, Pratihar, Deb (2023): NAO's single and double support, also with free joints, and a walking cycle.

Variables of both phases are in the paper's order, x1 to x9 and x1 to x8.

Options that the problems share:

    robot                  name or file of the robot
    intervals              equal parts of a phase over which torques may change by the limit
    derivatives            analytic, or finite-difference: of the sampled angles, as in the paper, of first order at the
                           ends; finite-difference-2: of second order there, too
    rotational_inertia     false takes every link as a point mass, in torques and ZMP
    step_length_m          from foot to foot; 0 for 0.06 m in proportion
    torso_share            rule that divides the torso's mass between the legs in double support, see
                           ``loads.share_torso``
    trajectory             of hip, swing foot and arms, or of every free joint: the paper's cubics, or cubics plus splines
    samples_per_interval   above 1 for a grid that is denser than the intervals; 0 for what suits the trajectory: 1 with
                           cubics, 4 with splines, which would otherwise bend between the samples
    rule                   of means over time: trapezoid, with the mean margins over samples, as in the paper; or simpson
    objective              what is minimised: power as in the paper, joint jerk, or the rate of torques
    arms                   carried by the legs, or separate: in the torques the legs carry a torso without arms, and each arm
                           moves on a torso at rest, the ZMP is that of all links; shared: likewise, but in double
                           support both arms add to the torso's mass that the legs share; held: carried, at rest in the
                           middle of their swing
    zmp_gravity            physical, or as printed in (19) and (20): the inertial part of the ZMP has the opposite sign, and
                           links are point masses in it. It moves the margins of the printed solutions by up to 0.9 mm in
                           single and 2.9 mm in double support
    zmp_masses             23: neck and head of double support are at the torso's centre of mass in the ZMP, as the text
                           counts there (25 in single support); moves the least margins by up to 0.3 mm
    motors                 features of the real motors, separated by commas, see ``gaits.biped.motors``; none by default
    landing                of a cycle's swinging foot: soft, at rest; or inelastic, an impact at touch-down after which all joints
                           go on with other rates, see ``gaits.biped.impact``
    limits                 more limits of every phase, separated by commas: FrictionCone, FootClearance, or your own,
                           FILE.py:NAME; see ``nlp_gait.limits``
"""
