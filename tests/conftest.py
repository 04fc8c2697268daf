"""Settings of every test."""

from hypothesis import settings

# The same examples on every run; no deadline, since the first call of a compiled or symbolic function is slow.
settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile("reproducible")
