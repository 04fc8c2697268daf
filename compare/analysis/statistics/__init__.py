"""Statistics of records: run lengths, expected running time, distributions, tests, effect sizes, profiles.

Pure functions of arrays and plain data; each names its source.
"""
