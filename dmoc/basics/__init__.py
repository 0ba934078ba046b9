"""What knows nothing of transfers: checks of arguments, files, numerics, machine code."""
