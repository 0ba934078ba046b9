"""Attempts on one mesh as values, and the problems that lead to theirs: held, rounded, or in a tube."""
