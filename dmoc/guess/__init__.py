"""Where to start: a path from physics."""
