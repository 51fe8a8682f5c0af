"""Translated texts shared by pages and reports: labels, captions, verdicts, drawings, units."""
