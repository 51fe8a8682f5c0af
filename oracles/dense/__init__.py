"""Densely sampled models, for comparison and for general-purpose optimizers."""
