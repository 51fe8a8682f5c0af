"""The service over ``solvers``."""

import os

# The solvers' matrices are small: a second thread in each product gains nothing, and when every core solves already
# it makes a check ten times slower. numpy reads this once, when it is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
