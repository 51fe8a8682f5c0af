"""The piston pin and the bushing at the edge: what can be asked, what is answered, and their pictures."""
