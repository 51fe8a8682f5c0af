"""A search for the scenes with the largest errors of a core function, in eps max(1, kappa), judged by the generators of
the references."""
