"""From motion to numbers for Ipopt."""
