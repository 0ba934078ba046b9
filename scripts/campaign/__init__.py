"""The random campaign: scenes that are feasible (or not) by construction, and a judge that knows no dmoc."""
