"""Run solves outside the service process: warm workers with a time budget and a memory limit, killed on overrun."""
