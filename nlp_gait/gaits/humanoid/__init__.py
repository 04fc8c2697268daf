"""Single support, double support and walking cycle of any humanoid with two legs of six turning joints.

The published phases of NAO (Gupta, Pratihar, Deb 2023) with a robot inferred from its file, legs of any build, and a torso that
may lean. Lengths are NAO's times lambda, the ratio of the legs' lengths; velocities and times scale with its root, so that Froude
numbers are equal; torques with lambda times the ratio of the masses. Bounds on velocities and on least times are wider by what
the robot's joints allow (``robots.biped``). Arms and other joints are held in a posture.
"""
