"""The exact functions as native code for whole populations: emitted C++, compiled, cached, called."""
