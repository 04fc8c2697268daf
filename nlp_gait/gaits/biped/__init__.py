"""What spatial bipeds share: a phase sampled over time, the parts of a gait, and the goals that it can have."""
