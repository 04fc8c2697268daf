"""Time histories of a motion on a grid, and stick figures."""
