"""The search for the best linkage, with its proof."""
