"""Mass reduction at the edge: what can be asked and what is answered."""
