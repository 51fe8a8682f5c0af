"""Design and analysis of crank mechanisms: a numerical library without I/O.

Everything is in SI units (m, N, Pa, kg, s, rad). Inputs are frozen dataclasses, results are typed
outcomes; nothing here knows of HTTP, SQL or files. One wing per subject (``solvers.rod`` …), the same
rooms in each: ``scene`` (the inputs), the physics by topic, ``effects``, ``check`` and ``design``.
"""
