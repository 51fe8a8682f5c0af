"""How much an effect may matter, before it is run."""
