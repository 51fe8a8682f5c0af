"""The full model as the search evaluates it: rows at peaks, contributions of corrections, exact checks."""
