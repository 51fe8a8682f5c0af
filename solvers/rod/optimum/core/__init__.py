"""The core's optimum: closed-form physics, from the peaks that govern."""
