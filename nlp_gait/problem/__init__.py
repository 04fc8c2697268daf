"""What a gait problem is."""
