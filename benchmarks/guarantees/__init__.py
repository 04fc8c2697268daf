"""What guarantees rest on: sound enclosures, narrow bounds, verdicts between samples, proofs that end."""
