"""An answer's own structure turned into legs, and how many impulses a mission has."""
