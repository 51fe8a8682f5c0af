"""The rows of docs/hard-cases.md, a module for every wing, each with its ``SECTIONS``."""
