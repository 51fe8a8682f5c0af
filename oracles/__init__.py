"""What bench and tests judge by and compare with. No part of the service: the solvers know nothing of it."""
