"""A biped on stairs: planned, tracked and ideal."""
