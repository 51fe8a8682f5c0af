"""A-priori bounds of the influence of effects."""
