"""How it moves: the discrete equations, forward in time, and an independent integrator."""
