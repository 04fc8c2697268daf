"""Every table about the physics engine: ``python -m benchmarks.engine [TABLE ...]`` (extra ``sim``)."""
