"""Speed of the package against what one would otherwise use: ``python -m benchmarks``."""
