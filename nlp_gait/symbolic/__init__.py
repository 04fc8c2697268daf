"""Pure functions of CasADi expressions: trajectories, kinematics, dynamics, balance. No solver, no options, no globals."""
