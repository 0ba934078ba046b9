"""Checks without Ipopt's word: residual, rollout, reference, ledger, bounds, optimality, stability."""
