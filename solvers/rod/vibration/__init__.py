"""Transverse inertia of the strip: natural frequencies, modes, steady response.

Terms: slow modes are integrated in time; fast modes follow the force and the slow modes quasi-statically, and ring
(vibrate freely) behind corners, i.e. angles at which the axial force or a derivative of it jumps. A panel is the
interval between two successive corners; panels are divided into elements. Angles are the variable of time: frequencies
are in 1/rad, and a mode's phase is its frequency times the angle.
"""
