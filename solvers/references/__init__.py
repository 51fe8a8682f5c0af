"""The same physics once more, by other means: textbook equations as they stand, in arbitrary precision.

Accuracy studies judge the solvers by them, the hard cases of the tests take their digits from them. Nothing here
imports a solver: of a scene only its numbers are taken. A model works in the present precision of mpmath, or in the
numbers of a context: ``mp``, or ``fp`` for floats, in which a search is quick that ``mp`` then finishes.

Source: F. Johansson et al., mpmath (arbitrary-precision floating-point arithmetic in Python).
"""
