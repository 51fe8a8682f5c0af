"""Solves outside the service process: warm workers with a time budget and a memory bound, killed when they overrun."""
