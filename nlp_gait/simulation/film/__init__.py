"""The simulated robot as films, and in MuJoCo's own window."""
