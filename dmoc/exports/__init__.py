"""Functions for others to run."""
