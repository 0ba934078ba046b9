"""Pictures of solutions, sweeps and studies."""
