"""Independent reference implementations: textbook equations in arbitrary precision.

Used by accuracy studies to judge the solvers and by tests for reference digits. Nothing here imports a solver; only the
numbers of a scene are used. A model works in mpmath's current precision, or with the numbers of a context: ``mp``, or
``fp`` for floats, in which a search is fast before ``mp`` refines it.

Source: F. Johansson et al., mpmath (arbitrary-precision floating-point arithmetic in Python).
"""
