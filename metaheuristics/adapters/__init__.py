"""Search algorithms of other packages, as strong opponents; each file imports its package only when a run begins."""
