"""Motion: the discrete equations, their march forward in time, and an independent integrator."""
