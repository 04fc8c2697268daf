"""Commands that ask a question past the papers."""
