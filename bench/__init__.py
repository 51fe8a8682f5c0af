"""Benchmarks against alternatives a user might choose."""
