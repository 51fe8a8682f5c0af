"""The strip's own inertia: natural frequencies, modes, steady response."""
