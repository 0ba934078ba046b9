"""Coarse to fine, to a tolerance, and why it failed."""
