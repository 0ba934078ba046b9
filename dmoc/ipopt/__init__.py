"""The optimiser: options for a problem on a mesh, one run, the meaning of its end, a stop from outside."""
