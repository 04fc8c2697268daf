"""Settings of every test."""

import signal

from hypothesis import settings

# The same examples on every run; no deadline, since the first call of a compiled or symbolic function is slow.
settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile("reproducible")

# A shell ignores Ctrl-C for what it runs in the background, and so would all that the tests of it start.
signal.signal(signal.SIGINT, signal.default_int_handler)
