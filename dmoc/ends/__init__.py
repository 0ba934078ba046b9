"""Where a transfer starts and ends."""
