"""Why there is no path: the values, rows and limits to blame, by name."""
