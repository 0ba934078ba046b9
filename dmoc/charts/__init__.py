"""Pictures of sweeps, studies and stability."""
