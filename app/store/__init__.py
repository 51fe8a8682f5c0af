"""The durable record of every run: SQLAlchemy tables, one writer with group commit, reads, verification.

All SQL of the project lives in this package.
"""
