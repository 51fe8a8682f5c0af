"""Design and analysis of crank mechanisms: a numerical library without I/O.

SI units throughout (m, N, Pa, kg, s, rad). Inputs are frozen dataclasses, results typed outcomes; no knowledge of HTTP,
SQL or files. One package per subject (``solvers.rod`` …) with the same modules: ``scene`` (inputs), the physics by
topic, ``effects``, ``check`` and ``design``.
"""
