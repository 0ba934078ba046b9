"""Paths by shooting: the motion under the best thrust, from first costates that are corrected."""
