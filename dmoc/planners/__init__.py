"""Functions of problems that need nothing of dmoc: integrator, residual, solver."""
