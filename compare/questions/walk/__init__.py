"""A whole walking cycle: its cost of transport over speed, and its playback."""
