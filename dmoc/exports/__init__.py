"""Functions for others to run, as files."""
