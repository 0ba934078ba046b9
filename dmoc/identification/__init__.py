"""Identification: numbers of a body from a flight, by the discrete equations run backwards."""
