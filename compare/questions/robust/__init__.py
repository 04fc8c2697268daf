"""One gait for a family of robots and grounds."""
