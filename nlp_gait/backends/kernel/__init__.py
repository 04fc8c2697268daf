"""The exact functions as native code for whole populations: C++ is written, compiled, cached and called."""
