"""How many steps, of which order, on which mesh."""
