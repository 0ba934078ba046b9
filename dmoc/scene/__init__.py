"""Where a transfer starts and ends, and the problem that its parts make."""
