"""Walking by the textbook: the ZMP is planned, the centre of mass follows by preview control, the legs by inverse kinematics."""
