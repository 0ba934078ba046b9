"""Flights as they were measured, and flights that are made for tests and for planning."""
