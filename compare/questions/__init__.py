"""Questions past the papers, which one differentiable model can answer."""
