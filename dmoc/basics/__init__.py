"""Tools that know nothing of transfers: checks of arguments, files, numerics, machine code."""
