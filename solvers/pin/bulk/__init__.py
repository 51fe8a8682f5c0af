"""Many pins at once: tables of arrays, lists of cases."""
