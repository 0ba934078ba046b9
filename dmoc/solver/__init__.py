"""Solving from coarse meshes to fine ones, to a tolerance, and the cause of a failure."""
