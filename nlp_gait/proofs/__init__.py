"""Everything that proves: enclosures over boxes, limits between samples, branch and bound, certificates.

An affine or quadratic form encloses a function over a box of its inputs. Along time, forms prove that a gait keeps its limits at
every instant (``guarantee.py``); over the variables, they prove that no feasible point is better than a bound
(``branch_and_bound.py``), which a certificate records (``certificate.py``).
"""
