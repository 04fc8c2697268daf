"""Questions that go beyond the papers and that one differentiable model can answer."""
