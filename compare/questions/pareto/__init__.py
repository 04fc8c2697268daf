"""Power against stability: fronts by gradient and by search."""
