"""The papers' problems written once more in NumPy, from the papers' equations and nothing of the package's mathematics."""
