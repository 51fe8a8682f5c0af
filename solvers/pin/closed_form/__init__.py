"""Stepped-bore pins under the rod force in closed form, without stations."""
