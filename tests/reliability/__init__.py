"""Attacks on a running service; a share of them runs with the suite, all of them by `make campaign`."""
