"""What a motion is: time histories on a grid, several steps of it, a stick figure, what an engine needs to play it."""
