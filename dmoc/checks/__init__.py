"""Not on Ipopt's word: residual, rollout, reference, ledger, bounds, optimality, stability."""
