"""Checks and proofs behind the guarantees: sound enclosures, narrow bounds, verdicts between samples, certificates."""
