"""Proofs about gaits and optima. Read in this order.

1. ``affine.py``, ``quadratic.py``: a form encloses a function over a box of its inputs, linear or of degree two. C++ interprets
   the function's instructions (``native/``: intervals, affine, quadratic; ``quadratic_tape.py`` prepares them).
2. ``time_search.py``, ``guarantee.py``: forms over pieces of time prove that a gait satisfies its limits at every instant.
3. ``boxes.py``, ``bounds.py``: forms over boxes of the variables prove that parts of a box hold no better feasible point.
   For NAO's phases there are formulas with narrow bounds (``nao/``, a ``PowerForm``).
4. ``branch_and_bound.py``: halving the boxes proves a bound on the objective; a checkpoint stores the open ones.
5. ``certificate.py``: the bound as a file, and the shipped ones (``certificates/``).

Words: a *form* has a middle, slopes, bends (of degree two) and an error, and a range from lower to upper. To *enclose* is to
compute forms, to *contract* to cut slabs off a box, to *prune* to remove all that holds no feasible point below a target cost.
"""
