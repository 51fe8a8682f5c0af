"""A search for scenes on which a core function errs most, in eps max(1, kappa), against the references' own makers."""
