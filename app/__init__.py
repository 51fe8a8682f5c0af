"""The HTTP service and command line over ``solvers``."""

import os

# The solvers' matrices are small: more BLAS threads gain nothing, and slow a check tenfold when all cores are busy.
# numpy reads this once, on its first import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
