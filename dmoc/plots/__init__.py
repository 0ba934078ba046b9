"""Pictures of solutions, of transfers and of missions."""
