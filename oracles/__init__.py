"""Independent models and searches used by benches and tests; not part of the service or the solvers."""
