"""Single support, double support and walking cycle of any humanoid with two legs of six turning joints.

The published phases of NAO (Gupta, Pratihar, Deb 2023) with a robot inferred from its file, legs of any build, and a torso that
may lean. Lengths are NAO's times lambda, the ratio of the legs' lengths; velocities and times scale with its root, so that Froude
numbers are equal; torques with lambda times the ratio of the masses. Bounds on velocities and on least times are wider by what
the robot's joints allow (``robots.biped``). Arms and other joints are held in a posture.

Options that the problems share:

    robot                  file of the robot, URDF, MJCF or JSON; or a name
    intervals              equal parts of a phase over which torques may change by the limit
    step_length_m          from foot to foot; 0 for NAO's 0.06 m times lambda
    slope_deg              by which the ground of a walk rises forward; all places are in its axes, in which gravity is tilted
    stair_rise_m           of each tread of a flight of stairs that a walk climbs, one with each step; 0 for no stairs
    stair_run_m            depth of each tread, which is then the step length
    drive_limits           whether torques and speeds must be within the limits of the robot's file
    trajectory             of hip, swing foot and torso: cubics, or cubics plus splines
    samples_per_interval   above 1 for a grid that is denser than the intervals; 0 for what suits the trajectory
    rule                   of means over time: trapezoid, with the mean margins over samples; or simpson
    objective              what is minimised: power, joint jerk, or the rate of torques; of a cycle energy per metre, or power
    motors                 features of the real motors, see ``gaits.biped.motors``, if the file has their data
    torso_share            in double support: the torso's mass is shared by the lever rule, or as printed
    landing                of a cycle's swinging foot: soft, at rest; or inelastic, an impact at touch-down after which all joints
                           go on with other rates, see ``gaits.biped.impact``
    limits                 more limits of every phase, see ``nlp_gait.limits``
"""
