"""Pictures of gaits, runs and distributions."""
