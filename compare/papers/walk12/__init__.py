"""A 12-joint walk at least energy and greatest balance margin."""
