"""A biped of point masses with twelve joints that walks straight and on a circle."""
